#pragma once
/// Studies at their quick size, and what tests look up in their results.

#include <stdexcept>
#include <string>

#include "engine/studies/study.h"

namespace test {

inline studies::StudyOptions quick_study(int threads = 1) {
    studies::StudyOptions options;
    options.quick = true;
    options.threads = threads;
    options.program = "tests";
    return options;
}

/// Throws std::out_of_range, which fails the test, where there is no such table.
inline const io::Table& table_of(const studies::StudyResult& result, const std::string& name) {
    for (const io::Table& table : result.tables)
        if (table.name == name) return table;
    throw std::out_of_range("no table " + name);
}

}  // namespace test
