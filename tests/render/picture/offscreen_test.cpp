#include "render/picture/offscreen.h"

#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "tests/engine/fixtures.h"

namespace {

using render::OffscreenContext;

TEST(Offscreen, ContextsStandSideBySideAndEndInAnyOrder) {
    std::vector<std::unique_ptr<OffscreenContext>> contexts;
    for (int i = 0; i < 3; ++i) contexts.push_back(std::make_unique<OffscreenContext>());
    for (const auto& context : contexts) EXPECT_NO_THROW(static_cast<void>(context->use()));
    contexts.erase(contexts.begin());
    for (const auto& context : contexts) EXPECT_NO_THROW(static_cast<void>(context->use()));
    contexts.clear();
    OffscreenContext after;
    EXPECT_NO_THROW(static_cast<void>(after.use()));
    EXPECT_NE(after.function("glClear"), nullptr);
}

TEST(Offscreen, NamesAFunctionThatDoesNotExist) {
    OffscreenContext context;
    const auto use = context.use();
    // Mesa hands out stubs for any name that begins with gl.
    test::expect_refusal<std::runtime_error>([&] { context.function("no such thing"); }, "no such thing");
}

TEST(Offscreen, AForkedProcessIsToldThatItHasNoRasteriser) {
    const OffscreenContext context;
    { const auto use = context.use(); }
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        int refused = 0;
        for (const bool of_parent : {true, false}) {
            try {
                if (of_parent)
                    static_cast<void>(context.use());
                else
                    OffscreenContext own;
            } catch (const std::runtime_error& error) {
                refused += std::string(error.what()).find("forked") != std::string::npos;
            }
        }
        _exit(refused);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 2);
}

}  // namespace
