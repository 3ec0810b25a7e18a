#include "engine/exercise/exercise.h"

#include "engine/exercise/imaging.h"

namespace exercise {

Exercise::Exercise(const scenario::Scenario& scenario, bool with_images, const anatomy::ModelCache& cache)
    : simulation_(scenario, cache), scorer_(simulation_) {
    if (!with_images) return;
    ImagingChain imaging =
        make_imaging(simulation_.scenario(), simulation_.anatomy(), simulation_.contrast());
    organs_ = std::move(imaging.organs);
    monitor_.emplace(std::move(imaging.fluoroscope));
    const int pixels = scenario.c_arm.pixels;
    black_ = {pixels, pixels, std::vector<std::uint8_t>(static_cast<std::size_t>(pixels) * pixels, 0)};
}

void Exercise::record(const std::filesystem::path& path, const script::RecordingHeader& header) {
    recording_.emplace(path, header);
}

void Exercise::close_recording() {
    if (recording_) recording_->close([&] { return simulation_.state_hash(); });
    recording_.reset();
}

StepReport Exercise::next_frame(std::span<const script::Command> commands) {
    ++frame_;
    const int resets = simulation_.resets();
    for (const script::Command& command : commands) simulation_.apply(script::canonical(command));
    const StepReport report = simulation_.step();
    if (simulation_.resets() != resets) {
        attempt_start_ = frame_;
        if (monitor_) monitor_->clear();
        masks_ = references_ = 0;
    }
    scorer_.observe(frame_, simulation_, report);
    if (recording_) recording_->frame(frame_, commands, [&] { return simulation_.state_hash(); });
    if (monitor_ && simulation_.pulse()) take_pulse();
    if (monitor_ && references_ != simulation_.console().references()) {
        references_ = simulation_.console().references();
        monitor_->store_reference();
    }
    return report;
}

void Exercise::take_pulse() {
    Pulse pulse = pulse_of(simulation_, organs_);
    pulse.frame = frame_;
    if (pulse.mode == script::ImagingMode::dsa) {
        pulse.new_mask = masks_ != simulation_.console().masks();
        masks_ = simulation_.console().masks();
    }
    monitor_->take(std::move(pulse));
}

const render::GrayImage& Exercise::image() {
    const render::GrayImage* shown = monitor_ ? monitor_->image() : nullptr;
    return shown ? *shown : black_;
}

Truth Exercise::truth() {
    return truth_of(*monitor_->last_pulse(), monitor_->fluoroscope());
}

Score Exercise::score() const {
    Score score = scorer_.score();
    if (monitor_) {
        score.air_kerma = monitor_->dose().air_kerma;
        score.area_product = monitor_->dose().area_product;
    }
    return score;
}

bool Exercise::time_is_up() const {
    const scenario::Scenario& scenario = simulation_.scenario();
    if (!scenario.time_limit) return false;
    return (frame_ + 1 - attempt_start_) >= *scenario.time_limit * scenario.frame_rate;
}

}  // namespace exercise
