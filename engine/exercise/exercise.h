#pragma once
/// One attempt at a scenario: the vessel and wire, the C-arm's picture, the score, the recording.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/monitor.h"
#include "engine/exercise/score.h"
#include "engine/exercise/simulation.h"
#include "engine/script/recording.h"
#include "render/picture/image.h"

namespace exercise {

/// What to make besides masks.
struct TruthParts {
    bool signal = false;    // of the detector, with its noise
    bool expected = false;  // the same without noise
    bool labels = false;    // of vessels
    bool lengths = false;   // of rays in each layer of the patient
    bool any() const { return signal || expected || labels || lengths; }
};

/// A lesion as it is at a frame's end: radii at places along its branch, from the origin [mm].
struct TrueLesion {
    std::string branch;
    std::vector<double> along, reference, radius;
    std::vector<double> stent;  // of a stent there; 0 = none
};
/// A stent, in the room [mm].
struct TrueStent {
    std::string device;
    bool attached = false;  // it has not left its balloon or sheath
    geometry::Vec3 proximal = geometry::Vec3::Zero(), distal = geometry::Vec3::Zero();  // its ends
    std::vector<double> radii;                                                          // from the distal end
};

/// Ground truth of an image, for training and testing trackers: where the wire, its tip and the vessels are.
struct Truth {
    Pulse pulse;                             // the pulse that the image shows
    std::vector<render::GrayImage> devices;  // of each of the pulse's: 255 where it casts its shadow, else 0
    render::GrayImage vessels;               // 255 where a lumen lies in the beam, else 0
    /// 255 where contrast that has leaked into tissue shows; empty where none has.
    std::optional<render::GrayImage> extravasation = {};
    std::optional<render::GrayImage> stents = {};  // 255 where one casts its shadow; empty without any
    double dose = 0;                               // of the pulse at the detector [nGy]
    std::optional<render::Field> signal = {}, expected = {};  // [quanta]
    std::optional<render::DeepImage> labels =
        {};                                  // the branch that the ray runs through longest, from 1; 0 = none
    std::vector<std::string> branches = {};  // names, that of label k at k − 1; with labels
    std::vector<render::Fluoroscope::LayerLength> lengths = {};
    std::vector<TrueLesion> lesions = {};  // of the vessels now
    std::vector<TrueStent> placed_stents = {};
};

/// Of the monitor's last pulse, which must exist.
Truth truth_of(Monitor&, const Simulation&, const TruthParts& = {});

/// Sets the names and hashes of scenario and anatomy.
void identify(script::Origin&, const Simulation&);

/// What an exercise makes of pulses.
enum class Pictures {
    None,  // nothing
    Dose,  // the dose for the score, which is the same to the bit as with images
    All    // images too
};

class Exercise {
public:
    /// Throws InputError when scenario and anatomy do not fit, when there are to be images and the vessel
    /// can't be imaged, or when there are to be images or doses and a file of the patient can't be used; and
    /// for what is wrong with the script, as Simulation does.
    Exercise(const scenario::Scenario&, Pictures, const anatomy::ModelCache& = {},
             const script::CommandScript* = nullptr);
    Exercise(const scenario::Scenario& scenario, bool with_images, const anatomy::ModelCache& cache = {})
        : Exercise(scenario, with_images ? Pictures::All : Pictures::None, cache) {}
    /// Another exercise without images in the state of one without images, whose vessels it shares. Its
    /// recording is not shared. Throws std::invalid_argument for an exercise with images.
    Exercise(const Exercise&);

    /// Records every frame from the next one on, with the names and hashes of scenario and anatomy in the
    /// header. Throws InputError when the file cannot be written.
    void record(const std::filesystem::path&, script::RecordingHeader);
    void close_recording();

    /// Applies commands, motion, relaxation, score and recording, and advances time by one frame.
    Frame next_frame(std::span<const script::Command>);

    /// The image on the screen after the frame: live while the beam is on, the last one (last-image hold)
    /// while it is off, black before the first. Depends on the frames made, not on which were displayed.
    const render::GrayImage& image();
    /// The screens; null without images.
    const Monitor* monitor() const { return monitor_ ? &*monitor_ : nullptr; }
    Monitor* monitor() { return monitor_ ? &*monitor_ : nullptr; }

    /// Retunes the simulation. Any recording must have ended before, as it could no longer be replayed.
    void retune(const Tuning& tuning, const anatomy::ModelCache& cache = {}) {
        simulation_.retune(tuning, cache);
    }

    /// Sets another target for the attempt, which must not have begun. Throws InputError as Simulation::aim.
    void aim(const scenario::Target&);

    /// Ground truth of the last image, which must exist.
    Truth truth(const TruthParts& = {});

    int frame() const { return time_.index; }        // the last one made, -1 before the first
    const FrameTime& time() const { return time_; }  // of the last frame made
    const Simulation& simulation() const { return simulation_; }
    bool completed() const { return scorer_.completed(); }
    Pictures pictures() const { return pictures_; }
    Score score() const { return with_dose(scorer_.score()); }
    /// Of the attempt; null where it is not measured.
    const Dose* dose() const;
    /// The score with what takes longer to compute: for the end of a run.
    Score finish() const { return with_dose(scorer_.finish()); }
    /// Those that a reset has ended, in order, without dose.
    std::span<const Score> earlier_attempts() const { return scorer_.earlier(); }
    /// Whether the last frame made has used up the scenario's time, or its beam.
    bool time_is_up() const;

    /// The whole state of an exercise except its recording, which goes on.
    struct Snapshot {
        std::uint64_t of = 0;  // scenario
        std::vector<std::byte> state;
    };
    Snapshot snapshot() const;
    /// Restores a snapshot: stepped on from there, every state, image, dose and score is the same to the bit
    /// as after snapshot(). Throws InputError, and changes nothing, for a snapshot of another scenario, or of
    /// an exercise with images when this one has none.
    void restore(const Snapshot&);

    /// The state of simulation, score and clock; with images, that of the screens as well.
    void state(geometry::StateStream&);

private:
    std::uint64_t fingerprint() const;
    Score with_dose(Score) const;

    Simulation simulation_;
    Scorer scorer_;
    Pictures pictures_;
    anatomy::ModelCache cache_;
    std::optional<Monitor> monitor_;
    /// Without images. Of files it is made at once, of a procedural body for the first pulse.
    std::optional<render::ExposureMeter> meter_;
    Dose dose_;  // of Pictures::Dose
    std::vector<BlushingOrgan> organs_;
    std::optional<script::Recording> recording_;
    render::GrayImage black_;
    FrameTime time_;  // of the last frame made
};

}  // namespace exercise
