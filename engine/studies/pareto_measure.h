#pragma once
/// How far a method is from rest after how much work: courses, and the tables that they come to.

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "engine/io/csv.h"
#include "engine/studies/pareto_methods.h"

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

/// A method on one wire, looked at while it works.
struct ParetoCourse {
    std::vector<CostPoint> points;  // in order of work
    std::vector<ParetoWork> work;   // at each
    double energy = 0;              // of the rest that its end leads to [N·mm]
    double basin = 0;               // distance of that rest from the global relaxer's [mm]
    double gradient = 0;            // |g|/C of that rest
    std::string end;                // why it stopped
};

/// From the centreline. `global_rest` is where the global relaxer comes to rest.
ParetoCourse from_centreline(const ParetoVessel&, const ParetoMethod&, int series, double fraction_of_work);

/// A wire at rest, and what the method gets: one more segment at its tip.
struct ParetoPush {
    physics::Chain before, pushed;
    physics::Chain rest;  // of the global relaxer after the push
};
/// Pushes spread over the tube from 0.4 N on; between them the wire is pushed by the global relaxer.
std::vector<ParetoPush> pareto_pushes(const ParetoVessel&, int count);
ParetoCourse course_of(const ParetoVessel&, const ParetoMethod&, const ParetoPush&, int series,
                       double fraction_of_work);

/// Farthest joint of the method's own end of a long run from the rest that this leads to: what is left when
/// all its work is done [mm]. The run starts at the global relaxer's rest of the whole wire.
struct ParetoFloor {
    double distance = 0;  // [mm]
    std::string end;
};
ParetoFloor floor_of(const ParetoVessel&, const ParetoMethod&, double fraction_of_work);

/// Courses of one method over the pushes of one or all tubes.
using ParetoCourses = std::vector<const ParetoCourse*>;

inline constexpr double no_figure = std::numeric_limits<double>::quiet_NaN();

/// Medians over pushes until a method stays within an accuracy. A push that does not get there counts as
/// infinitely long.
struct ParetoSpeed {
    double cpu_ms = 0;   // NaN where less than half of the pushes get there
    ParetoWork work;     // of the median, NaN with it
    double reached = 0;  // fraction of the pushes
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
