#pragma once
/// How far a score is from the expected one.

#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace test {

/// Every value of two scores that differs, nested ones by their path; numbers with a fraction may be off by
/// the tolerance times 1 + the value. Empty when they agree.
inline std::vector<std::string> score_differences(const nlohmann::json& expected,
                                                  const nlohmann::json& actual, double tolerance) {
    const nlohmann::json flat = expected.flatten(), other = actual.flatten();
    std::vector<std::string> wrong;
    for (const auto& [path, value] : flat.items()) {
        const auto found = other.find(path);
        if (found == other.end()) {
            wrong.push_back(path + " is missing");
            continue;
        }
        const bool numbers = value.is_number_float() && found->is_number();
        const bool same = numbers ? std::abs(found->get<double>() - value.get<double>()) <=
                                        tolerance * (1 + std::abs(value.get<double>()))
                                  : *found == value;
        if (!same) wrong.push_back(fmt::format("{}: {} instead of {}", path, found->dump(), value.dump()));
    }
    for (const auto& [path, value] : other.items())
        if (!flat.contains(path)) wrong.push_back(path + " is new");
    return wrong;
}

}  // namespace test
