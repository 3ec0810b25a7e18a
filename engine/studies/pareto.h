#pragma once
/// Speed against accuracy: processor time and counted work until the farthest joint stays within a distance
/// of rest, for every method of the paper, the global relaxer, and the classical rods that the paper names.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_pareto(const StudyOptions&);

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
