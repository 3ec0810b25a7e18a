#pragma once
/// What is published on the sizes of what devices do in hands: the one place that has these numbers. The
/// study holds its runs against them, and docs/hands.md is made from its table.

#include <limits>
#include <span>
#include <string_view>

namespace studies {

/// How well a number is known here.
enum class SourceMark {
    Read,        // in the source itself, or its abstract
    SecondHand,  // as another text gives it
    Memory,      // not checked
    None         // nothing was found
};
std::string_view name_of(SourceMark);

/// Published size of a behaviour: from low to high. Where there is none, both are not numbers.
struct PublishedSize {
    static constexpr double none = std::numeric_limits<double>::quiet_NaN();
    std::string_view behaviour, measure, unit;
    double low = none, high = none;
    std::string_view course;  // that it is of
    bool same_kind = false;   // whether that is the kind of course that the study runs
    std::string_view source;
    SourceMark mark = SourceMark::None;

    bool known() const { return low <= high; }
    bool holds(double size) const { return known() && same_kind && low <= size && size <= high; }
};

/// The thirteen behaviours, in the order of the study.
std::span<const PublishedSize> published_sizes();
/// Throws std::out_of_range for a behaviour that is not one of them.
const PublishedSize& published_size(std::string_view behaviour);

/// Published push at the hub of an exercise's kind of course, of the largest value that a run has [N].
struct PublishedPush {
    std::string_view scenario;
    double low = 0, high = 0;
    std::string_view course, source;
    SourceMark mark = SourceMark::None;
};
std::span<const PublishedPush> published_pushes();

}  // namespace studies
