#pragma once
/// Independent pieces of work shared among threads.

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

namespace physics {

/// Calls work(i) for every i < count, each once, on `threads` threads, the caller's among them. Pieces must
/// not depend on one another, so that the outcome is the same for any number of threads. `progress`, from 0
/// to 1, is told on the caller's thread. The first exception of any piece is thrown here.
template <class Work>
void parallel_for(std::size_t count, int threads, const Work& work,
                  const std::function<void(double)>& progress = {}) {
    constexpr std::size_t kBlock = 16;
    std::atomic<std::size_t> next{0};
    std::exception_ptr failure;
    std::atomic<bool> failed{false};
    auto run = [&](bool tells) {
        try {
            for (std::size_t first; !failed && (first = next.fetch_add(kBlock)) < count;) {
                for (std::size_t i = first; i < std::min(count, first + kBlock); ++i) work(i);
                if (tells && progress) progress(static_cast<double>(first) / static_cast<double>(count));
            }
        } catch (...) {
            if (!failed.exchange(true)) failure = std::current_exception();
        }
    };
    std::vector<std::jthread> others;
    for (int t = 1; t < threads; ++t) others.emplace_back(run, false);
    run(true);
    others.clear();  // joins
    if (failure) std::rethrow_exception(failure);
}

}  // namespace physics
