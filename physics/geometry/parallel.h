#pragma once
/// Independent pieces of work shared among threads.

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace geometry {

/// Calls work(i) for every i < count, each once, on `threads` threads including the caller's, in blocks of
/// neighbouring i. Pieces must not depend on one another, so that the outcome is the same for any number of
/// threads. `progress` is called on the caller's thread with a fraction from 0 to 1. When a piece throws, no
/// new block begins, and the exception of the lowest i that threw is rethrown here: the same one for any
/// number of threads, since blocks begin in order.
template <class Index, class Work>
void parallel_for(Index count, int threads, const Work& work,
                  const std::function<void(double)>& progress = {}, Index block = 16) {
    std::atomic<Index> next{0};
    std::atomic<bool> failed{false};
    std::mutex guard;
    std::exception_ptr failure;
    Index failed_at = count;
    const auto run = [&](bool reports) {
        for (Index first; !failed && (first = next.fetch_add(block)) < count;) {
            Index i = first;
            try {
                for (const Index end = std::min<Index>(count, first + block); i < end; ++i) work(i);
                if (reports && progress) progress(static_cast<double>(first) / static_cast<double>(count));
            } catch (...) {
                const std::lock_guard lock(guard);
                failed = true;
                if (i < failed_at) failed_at = i, failure = std::current_exception();
            }
        }
    };
    {
        std::vector<std::jthread> others;
        const Index blocks = (count + block - 1) / block;
        try {
            for (int t = 1; t < threads && static_cast<Index>(t) < blocks; ++t)
                others.emplace_back(run, false);
        } catch (const std::system_error&) {
            // The system gives no more of them: those there are do the work.
        }
        run(true);
    }
    if (failure) std::rethrow_exception(failure);
}

/// The same for a few long pieces, handed out one at a time.
template <class Work>
void for_each_index(int count, int threads, const Work& work) {
    parallel_for(count, threads, work, {}, 1);
}

}  // namespace geometry
