#include "engine/exercise.h"

#include "engine/imaging.h"

namespace engine {

struct Exercise::Pulse {
    render::CArm arm;
    std::vector<physics::Vec3> joints;
    render::Exposure exposure;
};

Exercise::Exercise(const Scenario& scenario, bool with_images, const ModelCache& cache)
    : simulation_(scenario, cache), scorer_(simulation_) {
    if (with_images) fluoroscope_ = make_fluoroscope(scenario, simulation_.anatomy());
}

Exercise::~Exercise() = default;

void Exercise::record(const std::filesystem::path& path, const RecordingHeader& header) {
    recording_.emplace(path, header);
}

void Exercise::close_recording() {
    if (recording_) recording_->close();
    recording_.reset();
}

StepReport Exercise::next_frame(std::span<const Command> commands) {
    ++frame_;
    const int resets = simulation_.resets();
    for (const Command& command : commands) simulation_.apply(canonical(command));
    const StepReport report = simulation_.step();
    if (simulation_.resets() != resets) {
        attempt_start_ = frame_;
        pulse_.reset();
        image_is_current_ = false;
    }
    scorer_.observe(frame_, simulation_, report);
    if (recording_) recording_->frame(frame_, commands, simulation_.state_hash());
    if (simulation_.beam_on() && fluoroscope_) take_pulse();
    return report;
}

void Exercise::take_pulse() {
    const Scenario& scenario = simulation_.scenario();
    if (!pulse_) pulse_ = std::make_unique<Pulse>();
    pulse_->arm = simulation_.c_arm();
    pulse_->joints = simulation_.wire().joints;
    pulse_->exposure.frame = static_cast<std::uint64_t>(frame_ - attempt_start_);
    pulse_->exposure.seed = scenario.seed;
    pulse_->exposure.detector_dose = scenario.imaging.detector_dose;
    pulse_->exposure.iodine = simulation_.iodine();
    image_is_current_ = false;
}

const render::GrayImage& Exercise::image() {
    if (image_is_current_) return image_;
    if (pulse_ && fluoroscope_) {
        image_ = fluoroscope_->expose(pulse_->arm, pulse_->joints, pulse_->exposure);
    } else {
        const int pixels = simulation_.c_arm().pixels;
        image_ = {pixels, pixels, std::vector<std::uint8_t>(static_cast<std::size_t>(pixels) * pixels, 0)};
    }
    image_is_current_ = true;
    return image_;
}

bool Exercise::time_is_up() const {
    const Scenario& scenario = simulation_.scenario();
    if (!scenario.time_limit) return false;
    return (frame_ + 1 - attempt_start_) >= *scenario.time_limit * scenario.frame_rate;
}

}  // namespace engine
