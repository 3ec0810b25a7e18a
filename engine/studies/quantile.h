#pragma once
/// Medians and other quantiles of a study's figures.

#include <algorithm>
#include <vector>

namespace studies {

/// The value that this fraction of all are below, 0.5 for the median and 1 for the largest; not a number
/// where there are none.
inline double quantile(std::vector<double> values, double fraction) {
    if (values.empty()) return std::nan("");
    const auto at =
        std::min(values.size() - 1, static_cast<std::size_t>(fraction * static_cast<double>(values.size())));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
    return values[at];
}

}  // namespace studies
