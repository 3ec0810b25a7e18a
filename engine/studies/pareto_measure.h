#pragma once
/// How far a method is from rest after how much work.

#include <span>
#include <string>
#include <vector>

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
ParetoCourse from_centreline(const ParetoVessel&, const ParetoMethod&, int series, double share_of_work);

/// A wire at rest, and what the method gets: one more segment at its tip.
struct ParetoPush {
    physics::Chain before, pushed;
    physics::Chain rest;  // of the global relaxer after the push
};
/// Pushes spread over the tube from 0.4 N on; between them the wire is pushed by the global relaxer.
std::vector<ParetoPush> pareto_pushes(const ParetoVessel&, int count);
ParetoCourse course_of(const ParetoVessel&, const ParetoMethod&, const ParetoPush&, int series,
                       double share_of_work);

/// Farthest joint of the method's own end of a long run from the rest that this leads to: what is left when
/// all its work is done [mm]. The run starts at the global relaxer's rest of the whole wire.
struct ParetoFloor {
    double distance = 0;  // [mm]
    std::string end;
};
ParetoFloor floor_of(const ParetoVessel&, const ParetoMethod&, double share_of_work);

}  // namespace studies
