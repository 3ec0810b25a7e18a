#pragma once
/// What happened in a recording, frame by frame, for a page that teaches.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/exercise/score.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace debrief {

/// One frame of the last attempt.
struct Moment {
    int frame = 0;                 // of the run
    double seconds = 0;            // of the attempt, at its end
    std::vector<double> inserted;  // of each device [mm]
    double turned = 0;             // of all hubs, so far [rad]
    double force = 0;              // largest of one joint on the wall [N]
    double injection = 0;          // [ml/s]
    double to_target = 0;          // [mm]
    bool beam = false;
    bool dsa = false, pulse = false;
    /// Of the balloon [atm], the narrowest place of the first lesion [mm], the contrast there [mg/ml]; empty
    /// where there is none.
    std::optional<double> balloon, lumen, iodine;
    geometry::Vec3 tip = geometry::Vec3::Zero();  // [mm]
};

/// What the screen showed at a moment.
struct KeyFrame {
    int frame = 0;
    std::string caption;
    std::vector<std::uint8_t> png;
};

struct Story {
    std::string file;  // of the recording
    script::Origin origin;
    scenario::Scenario scenario;
    exercise::Score score;
    std::vector<exercise::Score> earlier;
    std::vector<std::string> differences;  // of the states from the recorded ones
    std::vector<std::string> notices;
    std::vector<Moment> moments;
    /// Before the first inflation and after the last one; empty without both. `of_contrast`: whether contrast
    /// shows the lesion in both.
    std::vector<KeyFrame> treated;
    bool of_contrast = false;
    std::vector<KeyFrame> key_frames;  // in order; empty without images
    std::vector<geometry::CentrelineBranch> branches;
    geometry::Vec3 target = geometry::Vec3::Zero();  // [mm]
    /// A teacher's, of the last attempt and of those before it.
    std::vector<script::Comment> comments, comments_before;
};

struct StoryOptions {
    bool images = true;
    bool same_origin = true;  // refuse a recording of another scenario or anatomy
    anatomy::ModelCache cache;
    std::function<void(double part, const char* what)> progress;
    std::function<bool()> interrupted;
};

inline constexpr std::size_t most_key_frames = 10;

/// Plays the recording, and, with images, once more for the frames at which errors began, the first and the
/// last. Throws InputError for a recording that cannot be played. Without a value: interrupted.
std::optional<Story> tell(const scenario::Scenario&, const script::CommandScript&, const StoryOptions&);

}  // namespace debrief
