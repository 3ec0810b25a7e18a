#pragma once
/// Thirteen things that devices do in hands, each made by a small manipulation in an exercise that ships, and
/// measured by what the simulation reads. Nothing in the simulation knows of them.

#include <span>
#include <string>
#include <vector>

#include "engine/io/csv.h"
#include "engine/io/plot.h"
#include "engine/studies/hands_course.h"

namespace studies {

/// A device as it lies at a moment of the course.
struct DrawnPath {
    std::string moment, device;
    Polyline points;
};

/// What came of one manipulation.
struct BehaviourRun {
    std::string behaviour;           // of published_sizes()
    std::string scenario, devices;   // where, and with what
    std::string manipulation;        // a sentence
    double measured = std::nan("");  // in the unit of its published size
    bool appears = false;            // whether the behaviour was seen at all, whatever its size
    std::string note;                // what else was measured
    std::vector<HandSample> samples;
    std::size_t device = 0;  // whose curve is drawn
    HandBalance balance;
    std::vector<DrawnPath> paths;
    std::vector<geometry::CentrelineBranch> vessels;
};

class Trial;
/// A manipulation: what lies where, how the wire is brought to where something is measured, and what the hand
/// does there.
struct Behaviour {
    const char* name;  // of published_sizes()
    HandScene scene;
    const char* devices;
    const char* manipulation;  // all of it, a sentence
    double turned = 0;         // of the wire's hub first [rad]
    double fed = 0;            // of the wire then [mm]
    BehaviourRun (*make)(Trial&) = {};

    BehaviourRun run(const StudyOptions&) const;
};
/// In the order of published_sizes(). A quick study makes longer steps where nothing is measured.
std::span<const Behaviour> behaviours();

/// The farthest that a device's tip went back along its own direction while its hub was pushed on, over the
/// samples from `first` on; where it began and how far it had come there [mm].
struct Recoil {
    double length = 0;  // [mm]
    std::size_t from = 0, to = 0;
};
Recoil recoil(std::span<const HandSample>, std::size_t device, std::size_t first);

/// Distance across the first loop of the path, `behind` its farthest point in the direction that it came
/// from; not a number where the path nowhere comes back so far [mm].
double loop_width(const Polyline&, const Vec3& direction, double behind);

/// Every sample, or of long courses some and all that jump: the device that the behaviour is about, and the
/// energies.
io::Table curve_table(std::span<const BehaviourRun>);
/// Where devices lie at the moments that were kept.
io::Table path_table(std::span<const BehaviourRun>);
/// Balls inscribed in the vessels, for an outline.
io::Table vessel_table(std::span<const BehaviourRun>);

/// A picture for each behaviour, and one of all sizes beside the published ranges.
std::vector<io::Plot> hand_plots(std::span<const BehaviourRun>);

}  // namespace studies
