#include "physics/geometry/parallel.h"

#include <atomic>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace geometry {

TEST(Parallel, EveryIndexIsVisitedOnce) {
    for (const int threads : {1, 3, 50}) {
        std::vector<std::atomic<int>> visits(20), in_blocks(100);
        for_each_index(20, threads, [&](int i) { ++visits[i]; });
        for (const auto& count : visits) EXPECT_EQ(count, 1);
        parallel_for(std::size_t{100}, threads, [&](std::size_t i) { ++in_blocks[i]; });
        for (const auto& count : in_blocks) EXPECT_EQ(count, 1);
    }
    for_each_index(0, 4, [](int) { FAIL(); });
}

TEST(Parallel, TheLowestFailureIsRethrownOnAnyNumberOfThreads) {
    for (const int threads : {1, 2, 3, 8})
        for (const int block : {1, 4}) {
            try {
                parallel_for(
                    100, threads,
                    [](int i) {
                        if (i == 30 || i == 31 || i > 35) throw std::runtime_error(std::to_string(i));
                    },
                    {}, block);
                FAIL();
            } catch (const std::runtime_error& error) {
                EXPECT_STREQ(error.what(), "30") << threads << " " << block;
            }
        }
}

TEST(Parallel, NothingNewBeginsAfterAFailure) {
    int done = 0;
    EXPECT_THROW(for_each_index(1000, 1,
                                [&](int i) {
                                    ++done;
                                    if (i == 3) throw std::runtime_error("three");
                                }),
                 std::runtime_error);
    EXPECT_EQ(done, 4);
}

TEST(Parallel, ProgressIsReportedOnTheCallersThread) {
    const auto caller = std::this_thread::get_id();
    double last = 0;
    parallel_for(
        1000, 2, [](int) {},
        [&](double fraction) {
            EXPECT_EQ(std::this_thread::get_id(), caller);
            EXPECT_GE(fraction, last);
            EXPECT_LE(fraction, 1);
            last = fraction;
        });
}

}  // namespace geometry
