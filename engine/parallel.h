#pragma once
/// Independent pieces of work on several threads.

#include <functional>

namespace engine {

/// Calls work(0) … work(count − 1) on so many threads, each once, in no particular order. Rethrows the
/// exception of the lowest index.
void for_each_index(int count, int threads, const std::function<void(int)>& work);

}  // namespace engine
