#include "engine/exercise/exercise.h"

#include <stdexcept>
#include <utility>

#include "engine/exercise/imaging.h"
#include "engine/io/error.h"

namespace exercise {

Exercise::Exercise(const scenario::Scenario& scenario, Pictures pictures, const anatomy::ModelCache& cache,
                   const script::CommandScript* script)
    : simulation_(scenario, cache, script), scorer_(simulation_), pictures_(pictures), cache_(cache) {
    // Whatever is wrong with a patient's files is told before the run begins.
    const patient::PatientFiles& files = scenario.patient_files;
    if (pictures == Pictures::Dose && scenario.imaging.patient && !(files.ct.empty() && files.meshes.empty()))
        meter_ = make_meter(simulation_.scenario(), simulation_.anatomy(), cache_);
    if (pictures != Pictures::All) return;
    ImagingChain imaging =
        make_imaging(simulation_.scenario(), simulation_.anatomy(), simulation_.contrast(), cache);
    organs_ = std::move(imaging.organs);
    monitor_.emplace(std::move(imaging.fluoroscope));
    const int pixels = scenario.c_arm.pixels;
    black_ = {pixels, pixels, std::vector<std::uint8_t>(static_cast<std::size_t>(pixels) * pixels, 0)};
}

Exercise::Exercise(const Exercise& like)
    : simulation_(like.simulation_),
      scorer_(like.scorer_),
      pictures_(like.pictures_),
      cache_(like.cache_),
      meter_(like.meter_),
      dose_(like.dose_),
      time_(like.time_) {
    if (pictures_ == Pictures::All)
        throw std::invalid_argument("an exercise with images cannot be copied; expected one without");
}

void Exercise::aim(const scenario::Target& target) {
    simulation_.aim(target);
    scorer_ = Scorer(simulation_);
}

void identify(script::Origin& origin, const Simulation& simulation) {
    origin.scenario = simulation.scenario().name;
    origin.patient = simulation.scenario().patient;
    origin.scenario_hash = simulation.scenario().content;
    origin.anatomy_hash = anatomy::hash_of(simulation.anatomy());
}

void Exercise::record(const std::filesystem::path& path, script::RecordingHeader header) {
    identify(header.origin, simulation_);
    recording_.emplace(path, header);
}

void Exercise::close_recording() {
    if (recording_) recording_->close([&] { return simulation_.state_hash(); });
    recording_.reset();
}

Frame Exercise::next_frame(std::span<const script::Command> commands) {
    for (const script::Command& command : commands) simulation_.apply(script::canonical(command));
    Frame frame{{}, commands, simulation_.step(), simulation_, monitor(), dose()};
    time_ = frame.time = {time_.index + 1, simulation_.frames() - 1, simulation_.time()};
    scorer_.observe(frame);
    if (recording_) recording_->frame(frame.time.index, commands, [&] { return simulation_.state_hash(); });
    if (pictures_ == Pictures::Dose) {
        if (frame.motion.reset) dose_ = {};
        if (frame.motion.console.pulse) {
            if (!meter_) meter_ = make_meter(simulation_.scenario(), simulation_.anatomy(), cache_);
            dose_.add(simulation_.console().mode(),
                      meter_->technique(simulation_.console().arm(), metered_exposure(simulation_)));
        }
    }
    if (!monitor_) return frame;
    if (frame.motion.reset) monitor_->clear();
    if (frame.motion.console.pulse) {
        Pulse pulse = pulse_of(simulation_, frame.time, organs_);
        pulse.new_mask = frame.motion.console.mask;
        monitor_->take(std::move(pulse));
    }
    for (const script::ShiftMask& shift : frame.motion.console.shifts)
        frame.mask_shifts.push_back(monitor_->shift(shift));
    if (frame.motion.console.reference) monitor_->store_reference();
    return frame;
}

const render::GrayImage& Exercise::image() {
    const render::GrayImage* shown = monitor_ ? monitor_->image() : nullptr;
    return shown ? *shown : black_;
}

Truth Exercise::truth(const TruthParts& parts) {
    return truth_of(*monitor_, simulation_, parts);
}

const Dose* Exercise::dose() const {
    if (monitor_) return &monitor_->dose();
    return pictures_ == Pictures::Dose ? &dose_ : nullptr;
}

Score Exercise::with_dose(Score score) const {
    if (const Dose* given = dose()) {
        score.air_kerma = given->air_kerma;
        score.area_product = given->area_product;
        score.dose = *given;
    }
    return score;
}

bool Exercise::time_is_up() const {
    const scenario::Scenario& scenario = simulation_.scenario();
    if (scenario.time_limit && time_.attempt + 1 >= *scenario.time_limit * scenario.frame_rate) return true;
    return scenario.beam_limit && scorer_.score().beam_on_time >= *scenario.beam_limit - 1e-9;
}

void Exercise::state(geometry::StateStream& s) {
    s(simulation_, scorer_, time_);
    if (monitor_) s(*monitor_);
    if (pictures_ == Pictures::Dose) s(dose_);
}

/// Identifies what a state belongs to: the scenario as it was chosen, its vessels, and whether there are
/// images, or doses alone.
std::uint64_t Exercise::fingerprint() const {
    geometry::StateHash hash;
    scenario::Scenario s = simulation_.scenario();
    geometry::Vec3 target = simulation_.target();
    std::uint64_t triangles = simulation_.anatomy().lumen.triangles.size(),
                  images = pictures_ == Pictures::Dose ? 2 : monitor_.has_value();
    for (scenario::PlacedDevice& placed : s.devices)
        hash(placed.role, placed.device, placed.inserted, placed.roll, placed.pinned);
    hash(s.name, s.seed, s.frame_rate, s.segment_length, s.wall_model, s.wall_stiffness, s.torsion,
         s.wall_friction, s.entry.end, s.entry.sheath, s.entry.sheath_length, s.relaxer.kind,
         s.relaxer.tolerance, s.budget.updates, s.adaptive, s.c_arm, target, s.target.radius, s.target.hold,
         triangles, images);
    if (s.wall_variation) hash(*s.wall_variation);
    if (s.tip_error) hash(*s.tip_error);
    hash(s.tissue, s.injury);
    return hash.value();
}

Exercise::Snapshot Exercise::snapshot() const {
    return {fingerprint(), geometry::state_of(*this)};
}

void Exercise::restore(const Snapshot& snapshot) {
    if (snapshot.of != fingerprint())
        throw io::InputError(
            "a snapshot of another exercise was given; expected one of this scenario, made with images if "
            "this has them");
    geometry::restore_state(*this, snapshot.state);
}

namespace {

render::GrayImage mask(int pixels, const std::vector<std::uint32_t>& set) {
    render::GrayImage image{pixels, pixels,
                            std::vector<std::uint8_t>(static_cast<std::size_t>(pixels) * pixels, 0)};
    for (const std::uint32_t pixel : set) image.pixels[pixel] = 255;
    return image;
}

}  // namespace

Truth truth_of(Monitor& monitor, const Simulation& simulation, const TruthParts& parts) {
    const Pulse& pulse = *monitor.last_pulse();
    render::Fluoroscope& fluoroscope = monitor.fluoroscope();
    const int pixels = pulse.arm.pixels;
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    const auto& moves = pulse.exposure.vessel_moves;
    Truth truth;
    truth.pulse = pulse;
    truth.vessels = mask(pixels, fluoroscope.vessel_pixels(pulse.arm, shift, moves));
    for (const PulsedDevice& device : pulse.devices)
        truth.devices.push_back(mask(pixels, device_pixels(fluoroscope, pulse, device)));
    if (!pulse.stents.empty()) truth.stents = mask(pixels, stent_pixels(fluoroscope, pulse));
    truth.dose = monitor.last_dose();
    if (!pulse.exposure.clouds.empty())
        truth.extravasation =
            mask(pixels, render::cloud_pixels(pulse.arm, pulse.exposure.clouds, cloud_shows));
    if (parts.signal) {
        truth.signal = monitor.last_signal();
        const auto dose = static_cast<float>(truth.dose);
        for (float& value : truth.signal->values) value *= dose;
    }
    if (parts.expected) truth.expected = fluoroscope.expected_quanta(pulse.arm, pulse.seen(), pulse.exposure);
    if (parts.labels) {
        const blood::BloodFlow& blood = simulation.contrast().blood();
        std::vector<std::uint16_t> of_node;
        for (const blood::FlowCell& cell : blood.cells)
            of_node.push_back(static_cast<std::uint16_t>(cell.branch + 1));
        truth.labels = fluoroscope.vessel_labels(pulse.arm, shift, of_node, moves);
        for (const auto& branch : simulation.anatomy().branches) truth.branches.push_back(branch.name);
    }
    if (parts.lengths) truth.lengths = fluoroscope.layer_lengths(pulse.arm, pulse.exposure);
    for (const Lesion& lesion : simulation.treatment().lesions()) {
        TrueLesion& made = truth.lesions.emplace_back();
        made.branch = simulation.anatomy().branches[static_cast<std::size_t>(lesion.branch)].name;
        made.along = simulation.treatment().stretch_of(lesion).arc;
        for (const physics::OpenedPlace& place : lesion.places) {
            made.reference.push_back(place.reference);
            made.radius.push_back(place.radius);
            made.stent.push_back(std::min(place.stent, place.radius));
        }
    }
    for (const PlacedStent& stent : simulation.treatment().stents()) {
        if (stent.samples.empty()) continue;
        TrueStent& made = truth.placed_stents.emplace_back();
        made.device = stent.device;
        made.attached = stent.attached;
        const geometry::Polyline axis = simulation.axis_now(stent);
        made.distal = axis.front();
        made.proximal = axis.back();
        for (const PlacedStent::Sample& sample : stent.samples)
            made.radii.push_back(std::min(sample.place.stent, sample.place.radius));
    }
    return truth;
}

}  // namespace exercise
