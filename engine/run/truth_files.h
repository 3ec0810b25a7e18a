#pragma once
/// Ground truth of images, as files next to the images.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "engine/exercise/exercise.h"
#include "engine/run/picture_file.h"

namespace run {

/// The text of frame_000123.json: C-arm, camera matrix (rows of P, which maps patient coordinates [mm] to
/// pixels by (u·w, v·w, w) = P·(x, y, z, 1); pixel centres lie at halves), joints in both, the tip, and the
/// names of the files beside it, with what their levels mean. `lengths_of`: the frame whose files have the
/// lengths of rays in layers; -1 = none.
std::string to_json(const exercise::Truth&, const exercise::FrameTime&, int lengths_of = -1);

/// Whether a file of a frame has one of the endings after the number that are written here, "_wire.png" or
/// ".json".
bool is_truth_ending(const std::string&);

/// Writes frame_000123.json, frame_000123_wire.png and whatever else the truth has, on a thread of its own.
/// Lengths in layers are written once for each pose of C-arm and patient.
class TruthFolder {
public:
    /// The folder must exist.
    TruthFolder(std::filesystem::path folder, const exercise::TruthParts&);

    /// There must have been a pulse. Throws InputError when this frame or an earlier one failed.
    void take(exercise::Exercise&, const exercise::FrameTime&);
    /// Whether the last take alone was too long for somebody who waits for the end.
    bool is_slow() const { return slow_; }
    /// The run was interrupted: what waits to be written is only written as far as that takes a moment. A
    /// frame of whose truth not all is written then has nothing of it.
    void hurry();
    /// Returns when all is written. Throws like take.
    void finish();

private:
    std::filesystem::path folder_;
    exercise::TruthParts parts_;
    /// Where all was, of the last lengths.
    struct Pose {
        render::CArm arm;
        geometry::Vec3 shift;
        double breath, beat, drift;
        bool operator==(const Pose&) const = default;
    };
    std::optional<Pose> pose_;
    std::vector<render::Fluoroscope::LayerLength> layers_;  // names alone
    int lengths_of_ = -1;
    bool slow_ = false;
    /// When to give up, as a count of the steady clock; shared with the thread that writes.
    std::shared_ptr<std::atomic<std::int64_t>> deadline_;
    WriteQueue queue_;
};

}  // namespace run
