#include "engine/parallel.h"

#include <atomic>
#include <gtest/gtest.h>
#include <stdexcept>

namespace engine {

TEST(Parallel, EveryIndexIsVisitedOnce) {
    for (const int threads : {1, 3, 50}) {
        std::vector<std::atomic<int>> visits(20);
        for_each_index(20, threads, [&](int i) { ++visits[i]; });
        for (const auto& count : visits) EXPECT_EQ(count, 1);
    }
    for_each_index(0, 4, [](int) { FAIL(); });
}

TEST(Parallel, TheFirstFailureIsRethrownAfterAllWork) {
    std::atomic<int> done = 0;
    try {
        for_each_index(10, 3, [&](int i) {
            ++done;
            if (i == 3 || i == 7) throw std::runtime_error(std::to_string(i));
        });
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "3");
    }
    EXPECT_EQ(done, 10);
}

}  // namespace engine
