#pragma once
/// Courses of pushes, pulls and turns that bring a device to the target, found by trying: states of an
/// exercise are kept and gone back to, and what a move does is what the simulation makes of it. Centrelines
/// only measure how far the rest of the way is.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/author/solution.h"
#include "engine/exercise/exercise.h"

namespace plan {

/// How a move ends that does not reach the target.
enum class Ending {
    Slips,      // the tip goes into a branch that does not lead there
    Passes,     // the tip goes past the mouth of the branch that leads there
    FallsBack,  // the tip goes back, though the device goes in
    Prolapses,  // the device goes in and its tip stays
    Wedges,     // the shaft outside bows, or the device is too thick to go on
    Refused,    // a motion that led to no rest
    Injures,    // the wall tears
    Leaves,     // the vessels, by an end
    Used        // all of the device is in
};
inline constexpr std::array<std::string_view, 9> ending_names = {
    "slips", "passes", "falls back", "prolapses", "wedges", "refused", "injures", "leaves", "used"};

/// Where moves have ended, those of one kind at one place together.
struct Failure {
    Ending ending = Ending::Prolapses;
    script::DeviceRole device = script::DeviceRole::Wire;  // that was moved
    std::string branch;                                    // that its tip was in then
    double along = 0;                                      // from that branch's start [mm]
    double left = 0;                                       // of the way to the target, of the nearest [mm]
    int times = 0;
};

/// Frames are counted from the exercise's start.
struct Course {
    std::vector<author::ScriptLine> lines;
    int frames = 0;
    double left = 0;  // of the way to the target, of the device that is to reach it [mm]

    std::string text(const std::vector<std::string>& comments = {}) const;  // of the script
    script::CommandScript script() const;
    int turns() const;      // of hubs, those of neighbouring frames as one
    int exchanges() const;  // of the wire
};

/// Whether the tip has stayed in the target for the hold; a lesion there may be as narrow as it is.
class Stay {
public:
    explicit Stay(const scenario::Scenario&);
    void look(const exercise::Simulation&);
    bool stayed() const { return stayed_; }
    int frames() const { return frames_; }  // that it takes

private:
    int frames_, in_ = 0;
    bool stayed_ = false;
};

struct SearchOptions {
    int threads = 2;            // the outcome does not depend on it
    std::uint64_t seed = 1;     // of the angles that restarts try
    int restarts = 2;           // with other angles, where the target was not reached
    bool other_angles = false;  // from the first try on
    /// Of the catalogue, that the wire may be exchanged for through what lies around it.
    std::vector<std::string> wires = {};
    long most_frames = 40'000;
    std::size_t courses = 6;                                 // that are enough
    std::function<void(double done, double left)> progress;  // left: the shortest way so far [mm]
    std::function<bool()> stop;                              // asked between moves
};

struct Found {
    std::vector<Course> courses;    // that reach the target, in the order found
    Course nearest;                 // of all states
    std::vector<Failure> failures;  // the nearest to the target first
    long frames = 0;
    std::size_t states = 0;  // kept
    bool stopped = false;    // by options.stop
};

/// Searches from the state of `start`, which must have no images and is not changed. The target is reached
/// when the tip of the target's device has stayed in it for the hold; a lesion that is to be opened there
/// is not treated. Throws InputError where no way along centrelines leads from the tip to the target, and for
/// a wire to exchange that does not fit.
Found search(const exercise::Exercise& start, const SearchOptions& = {});

/// What may be turned to some effect: the device has a shape.
bool is_shaped(const physics::DeviceSpec&);

}  // namespace plan
