#pragma once
/// What the courses of the study of speed against accuracy come to: tables, and what cannot be reached.

#include <string>
#include <vector>

#include "engine/io/table.h"
#include "engine/studies/pareto_measure.h"

namespace studies {

/// Courses of one method over the pushes of one or all tubes.
using ParetoCourses = std::vector<const ParetoCourse*>;

/// Medians over pushes until a method stays within an accuracy. A push that does not get there counts as
/// infinitely long.
struct ParetoSpeed {
    double cpu_ms = 0;   // NaN where less than half of the pushes get there
    ParetoWork work;     // of the median, NaN with it
    double reached = 0;  // share of the pushes
};
ParetoSpeed speed_at(const ParetoCourses&, double accuracy);

double median(std::vector<double>);

/// A number for readers: 330, 0.21, 3.7e+05; two digits.
std::string two_digits(double);

/// Accuracies of the curves, four a decade, and of the tables, one a decade [mm].
std::vector<double> curve_accuracies();
inline constexpr double table_accuracies[] = {1, 0.1, 0.01, 0.001, 0.0001};

/// Why less than half of the pushes get within the accuracy: what the method's end says of it. Empty where
/// they do. `floor` is that of a rival [mm], NaN for others.
std::string cannot_reach(const ParetoMethod&, const ParetoCourses&, double floor);

/// A row for each method: time and work for every accuracy, and what it cannot reach.
io::Table speed_table(const std::vector<ParetoMethod>&, const std::vector<ParetoCourses>&,
                      const std::vector<double>& floors);

/// Rows of one vessel, or of all, for the curves; columns as made by curves_table().
io::Table curves_table();
void add_curves(io::Table&, const std::string& vessel, const std::vector<ParetoMethod>&,
                const std::vector<ParetoCourses>&);

/// From the centreline: for each vessel and accuracy the method that reaches it, to stay, in the least time.
io::Table best_table(const std::vector<ParetoVessel>&, const std::vector<ParetoMethod>&,
                     const std::vector<ParetoCourse>&);

}  // namespace studies
