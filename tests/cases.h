#pragma once
/// How many random cases tests make.

#include <algorithm>
#include <cstdlib>

namespace test {

/// With SELDINGER_ALL_CASES, as `ctest -L long` sets it, all of them; or else the first quarter.
inline bool all_cases() {
    return std::getenv("SELDINGER_ALL_CASES") != nullptr;
}
inline int cases(int all) {
    return all_cases() ? all : std::max(1, all / 4);
}

}  // namespace test
