#pragma once
/// One attempt at a scenario: the vessel and wire, the C-arm's picture, the score, the recording.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/monitor.h"
#include "engine/exercise/score.h"
#include "engine/exercise/simulation.h"
#include "engine/exercise/truth.h"
#include "engine/script/recording.h"
#include "render/picture/image.h"

namespace exercise {

class Exercise {
public:
    /// Throws InputError when scenario and anatomy do not fit, or `with_images` and the vessel can't be
    /// imaged.
    Exercise(const scenario::Scenario&, bool with_images, const anatomy::ModelCache& = {});

    /// From the next frame on, frames are recorded. Throws InputError when the file cannot be written.
    void record(const std::filesystem::path&, const script::RecordingHeader&);
    void close_recording();

    /// Commands, motion, relaxation, score, recording; time goes on by one frame.
    Frame next_frame(std::span<const script::Command>);

    /// What the screen shows after the frame: a live image while the beam is on, the last one (last-image
    /// hold) while it is off, black before the first. Depends on the frames made, not on which were looked
    /// at.
    const render::GrayImage& image();
    /// The screens; null without images.
    const Monitor* monitor() const { return monitor_ ? &*monitor_ : nullptr; }
    Monitor* monitor() { return monitor_ ? &*monitor_ : nullptr; }

    /// Of the simulation; a recording must have ended before, as it could not be replayed.
    void retune(const Tuning& tuning, const anatomy::ModelCache& cache = {}) {
        simulation_.retune(tuning, cache);
    }

    /// Ground truth of the last image. There must have been an image.
    Truth truth();

    int frame() const { return time_.index; }  // the last one made, -1 before the first
    const Simulation& simulation() const { return simulation_; }
    Score score() const;
    /// The scenario's time is up after the last frame made.
    bool time_is_up() const;

    /// All of an exercise but its recording, which goes on.
    struct Snapshot {
        std::uint64_t of = 0;  // scenario
        std::vector<std::byte> state;
    };
    Snapshot snapshot() const;
    /// Stepped on, every state, image, dose and score is as it was after snapshot(), to the bit. Throws
    /// InputError for one of another scenario, or of an exercise with images where this has none, and then
    /// changes nothing.
    void restore(const Snapshot&);

    /// Without images the simulation's, the score's and the clock's; else the screens' as well.
    void state(geometry::StateStream&);

private:
    std::uint64_t fingerprint() const;

    Simulation simulation_;
    Scorer scorer_;
    std::optional<Monitor> monitor_;
    std::vector<BlushingOrgan> organs_;
    std::optional<script::Recording> recording_;
    render::GrayImage black_;
    FrameTime time_;  // of the last frame made
};

}  // namespace exercise
