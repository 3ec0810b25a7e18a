#include "render/picture/offscreen.h"

#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using render::OffscreenContext;

TEST(Offscreen, ContextsStandSideBySideAndEndInAnyOrder) {
    std::vector<std::unique_ptr<OffscreenContext>> contexts;
    for (int i = 0; i < 3; ++i) contexts.push_back(std::make_unique<OffscreenContext>());
    for (const auto& context : contexts) EXPECT_NO_THROW(context->make_current());
    contexts.erase(contexts.begin());
    for (const auto& context : contexts) EXPECT_NO_THROW(context->make_current());
    contexts.clear();
    OffscreenContext after;
    EXPECT_NO_THROW(after.make_current());
    EXPECT_NE(after.function("glClear"), nullptr);
}

TEST(Offscreen, NamesAFunctionThatDoesNotExist) {
    OffscreenContext context;
    context.make_current();
    // Mesa hands out stubs for any name that begins with gl.
    try {
        context.function("no such thing");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("no such thing"), std::string::npos);
    }
}

}  // namespace
