#pragma once
/// What the study of speed against accuracy reads from the course of a method.

#include <span>
#include <vector>

namespace studies {

/// A method after some of its work.
struct CostPoint {
    int series = 0;        // the vessel and method it belongs to
    double cpu = 0;        // so far [s]
    double deviation = 0;  // of the farthest joint from the rest that the method's own end leads to [mm]
};

/// Indices of the points that no other beats in both time and deviation, sorted by time.
std::vector<int> pareto_front(std::span<const CostPoint>);

/// The first point of one series, in order of work, from which on the deviation stays within the accuracy; −1
/// if there is none.
int settled_at(std::span<const CostPoint>, double accuracy);

}  // namespace studies
