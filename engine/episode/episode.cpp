#include "engine/episode/episode.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>
#include <variant>

#include "engine/exercise/device_rules.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "render/xray/subtraction.h"

namespace episode {

using exercise::Pulse;
using exercise::Simulation;

namespace {

constexpr int fewest_pixels = 32, most_pixels = 2048;
/// Frames that the noise of a mask is drawn for, apart from those of images.
constexpr std::uint64_t mask_frames = std::uint64_t{1} << 40;

void require_pixels(int pixels) {
    if (pixels < fewest_pixels || pixels > most_pixels)
        throw io::InputError(fmt::format("an image of {} pixels; {} to {} along a side are accepted", pixels,
                                         fewest_pixels, most_pixels));
}

render::GrayImage filled(int pixels, const std::vector<std::uint32_t>& set) {
    render::GrayImage image{pixels, pixels,
                            std::vector<std::uint8_t>(static_cast<std::size_t>(pixels) * pixels, 0)};
    for (const std::uint32_t pixel : set) image.pixels[pixel] = 255;
    return image;
}

/// The signal of a pulse, per nGy.
render::Field signal_of(render::Fluoroscope& fluoroscope, const Pulse& pulse,
                        const render::SeenDevices& seen) {
    render::Field signal = fluoroscope.read(pulse.arm, seen, pulse.exposure);
    const double dose =
        fluoroscope.technique(pulse.arm, pulse.exposure).delivered * pulse.exposure.detector_dose;
    for (float& value : signal.values) value *= static_cast<float>(1.0 / dose);
    return signal;
}

}  // namespace

Camera::Camera(const Simulation&, const anatomy::ModelCache& cache) : cache_(cache) {}

exercise::ImagingChain& Camera::chain(const Simulation& simulation) {
    if (!chain_)
        chain_ = exercise::make_imaging(simulation.scenario(), simulation.anatomy(), simulation.contrast(),
                                        cache_);
    return *chain_;
}

Pulse Camera::pulse(const Simulation& simulation, const exercise::FrameTime& time,
                    const render::CArm& arm) const {
    require_pixels(arm.pixels);
    Pulse pulse = exercise::pulse_of(simulation, time,
                                     chain_ ? chain_->organs : std::span<const exercise::BlushingOrgan>());
    // Before the first frame the noise is that of frame 0.
    if (time.attempt < 0) pulse.exposure.frame = 0;
    pulse.arm = arm;
    return pulse;
}

render::GrayImage Camera::image(const Simulation& simulation, const exercise::FrameTime& time,
                                const render::CArm& arm, ImageMode mode, std::optional<std::uint64_t> seed) {
    if (mode == ImageMode::Screen)
        throw io::InputError("the mode 'screen' was asked for; it is accepted with images=True");
    require_pixels(arm.pixels);
    render::Fluoroscope& fluoroscope = chain(simulation).fluoroscope;
    Pulse pulse = this->pulse(simulation, time, arm);
    if (seed) pulse.exposure.seed = *seed;
    const bool live = mode == ImageMode::Live;
    const script::ImagingMode as = live ? script::ImagingMode::Live : script::ImagingMode::Dsa;
    pulse.exposure.detector_dose = exercise::detector_dose(simulation.scenario(), pulse.arm, as);
    if (live) return fluoroscope.expose(pulse.arm, pulse.seen(), pulse.exposure);
    const render::Field signal = signal_of(fluoroscope, pulse, pulse.seen());
    Pulse mask = pulse;
    exercise::remove_contrast(mask.exposure);
    mask.exposure.frame += mask_frames;
    render::Field before = signal_of(fluoroscope, mask, {});
    render::Field scatter = fluoroscope.scatter_in(before, mask.arm, mask.exposure);
    const render::Subtraction subtraction(std::move(before), fluoroscope.opening(mask.arm),
                                          std::move(scatter));
    return subtraction.subtracted(signal);
}

const Camera::Masks& Camera::masks(const Simulation& simulation, const exercise::FrameTime& time,
                                   const render::CArm& arm) {
    Pulse pulse = this->pulse(simulation, time, arm);
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    const bool view = masks_ && masked_.arm == pulse.arm && masked_.exposure.vessel_shift == shift;
    const bool devices = view && masked_.joints == pulse.joints && masked_.catheter == pulse.catheter &&
                         !pulse.wire_look && !masked_.wire_look;
    if (devices) return *masks_;
    if (!chain_ && !masking_) masking_ = exercise::make_masking(simulation.scenario(), simulation.anatomy());
    render::Fluoroscope& fluoroscope = chain_ ? chain_->fluoroscope : *masking_;
    Masks made = masks_ ? std::move(*masks_) : Masks();
    masks_.reset();
    if (!view) made.vessels = filled(arm.pixels, fluoroscope.vessel_pixels(pulse.arm, shift));
    made.wire = filled(arm.pixels, fluoroscope.wire_pixels(pulse.arm, pulse.seen(), shift));
    made.catheter.reset();
    if (simulation.has_catheter())
        made.catheter = filled(arm.pixels, fluoroscope.catheter_pixels(pulse.arm, pulse.seen(), shift));
    masked_ = std::move(pulse);
    return masks_.emplace(std::move(made));
}

Log::Entry::~Entry() {
    // Entry by entry: each holds the one before, and a long chain would exhaust the stack. It is done here,
    // as any copy, assignment or end of a log, in any thread, may give up the last hold on a chain.
    while (before && before.use_count() == 1) before = std::shared_ptr<Entry>(std::move(before->before));
}

void Log::add(std::vector<script::Command> commands, std::uint64_t hash) {
    const int frame = frames();
    auto entry = std::make_shared<Entry>();
    entry->before = std::move(last_);
    entry->commands = std::move(commands);
    entry->hash = hash;
    entry->frame = frame;
    last_ = std::move(entry);
}

void Log::save(const std::filesystem::path& path, const script::Origin& origin, std::uint64_t hash) const {
    std::vector<const Entry*> entries;
    for (const Entry* entry = last_.get(); entry; entry = entry->before.get()) entries.push_back(entry);
    script::Recording recording(path, {origin, hash_every});
    for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry)
        recording.frame((*entry)->frame, (*entry)->commands, [&] { return (*entry)->hash; });
    recording.close([&] { return hash; });
}

Episode::Episode(const scenario::Scenario& scenario, exercise::Pictures pictures,
                 const anatomy::ModelCache& cache)
    : exercise_(scenario, pictures, cache), reader_(exercise_.simulation()), cache_(cache) {
    start_ = std::make_shared<Snapshot>(snapshot());
}

Episode::Episode(const Episode& like)
    : exercise_(like.exercise_),
      reader_(like.reader_),
      cache_(like.cache_),
      start_(like.start_),
      room_(like.room_) {
    reset();
}

/// What a frame would reject when a part of it has taken effect.
void Episode::check(std::span<const script::Command> commands) const {
    const scenario::Scenario& scenario = simulation().scenario();
    script::CommandScript asked;
    for (const script::Command& command : commands) {
        if (!simulation().has_catheter() && exercise::needs_catheter(command))
            throw io::InputError(exercise::no_catheter(command));
        asked.commands.push_back({0, command, {}});
    }
    if (const auto wrong = script::problems(asked, simulation().console().arm(), scenario.frame_rate);
        !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
}

void Episode::ask(const script::Command& command) {
    asked_.push_back(command);
    try {
        check(asked_);
    } catch (const io::InputError&) {
        asked_.pop_back();
        throw;
    }
}

render::CArm Episode::arm(int pixels) const {
    exercise::Console console = simulation().console();
    for (const script::Command& command : asked_) {
        if (const auto* move = std::get_if<script::MoveArm>(&command)) console.apply(*move);
        if (const auto* table = std::get_if<script::MoveTable>(&command)) console.apply(*table);
        if (const auto* field = std::get_if<script::Collimate>(&command)) console.apply(*field);
    }
    render::CArm arm = console.arm();
    arm.pixels = pixels;
    return arm;
}

void Episode::step(std::span<const script::Command> given) {
    std::vector<script::Command> commands = asked_;
    commands.insert(commands.end(), given.begin(), given.end());
    check(commands);
    // These are rejected as they take effect.
    const auto is_uncertain = [](const script::Command& command) {
        return std::holds_alternative<script::Inject>(command) ||
               std::holds_alternative<script::Exchange>(command);
    };
    const bool uncertain = std::ranges::any_of(commands, is_uncertain);
    const exercise::Exercise::Snapshot before =
        uncertain ? exercise_.snapshot() : exercise::Exercise::Snapshot();
    try {
        const exercise::Frame frame = exercise_.next_frame(commands);
        reader_.observe(frame);
        if (room_) room_->observe(frame, exercise_.score());
    } catch (const io::InputError&) {
        if (uncertain) exercise_.restore(before);
        // One that stayed would be rejected in every later frame, too.
        std::erase_if(asked_, is_uncertain);
        throw;
    }
    asked_.clear();
    hash_.reset();
    log_.add(std::move(commands), log_.states_next() ? hash() : 0);
}

std::uint64_t Episode::hash() const {
    if (!hash_) hash_ = simulation().state_hash();
    return *hash_;
}

void Episode::reset() {
    restore(*start_);
    log_.clear();
}

void Episode::aim(const scenario::Target& target) {
    reset();
    exercise_.aim(target);
    reader_.aim(simulation());
    start_ = std::make_shared<Snapshot>(snapshot());
}

Episode::Snapshot Episode::snapshot() const {
    Snapshot made = {exercise_.snapshot(), geometry::state_of(reader_), log_, asked_};
    if (room_) made.room = geometry::state_of(*room_);
    return made;
}

void Episode::restore(const Snapshot& snapshot) {
    exercise_.restore(snapshot.exercise);
    geometry::restore_state(reader_, snapshot.reader);
    log_ = snapshot.log;
    asked_ = snapshot.asked;
    if (room_) {
        room_.emplace();
        if (!snapshot.room.empty()) geometry::restore_state(*room_, snapshot.room);
    }
    hash_.reset();
}

void Episode::follow_room() {
    if (room_) return;
    room_.emplace();
    start_ = std::make_shared<Snapshot>(snapshot());
}

render::ColourImage Episode::panel(render::Panel& drawn, Camera* with, std::optional<std::uint64_t> seed) {
    if (!room_) throw io::InputError("the panel was asked for; it is accepted with panel=True");
    const exercise::Frame frame{exercise_.time(), {}, {}, simulation(), exercise_.monitor(),
                                exercise_.dose()};
    const exercise::Monitor* monitor = exercise_.monitor();
    const render::GrayImage image =
        monitor
            ? exercise_.image()
            : (with ? *with : camera())
                  .image(simulation(), frame.time, arm(drawn.live_area(1, 1).width), ImageMode::Live, seed);
    return drawn.draw(image, monitor ? monitor->reference() : nullptr, room_->read(frame, exercise_.score()));
}

Camera& Episode::camera() {
    if (!camera_) camera_ = std::make_unique<Camera>(simulation(), cache_);
    return *camera_;
}

render::GrayImage Episode::image(int pixels, ImageMode mode, std::optional<std::uint64_t> seed) {
    if (mode == ImageMode::Screen && exercise_.monitor()) {
        render::GrayImage shown = exercise_.image();
        if (pixels != shown.width)
            throw io::InputError(fmt::format("the screen in {} pixels was asked for; it has {} along a side",
                                             pixels, shown.width));
        return shown;
    }
    return camera().image(simulation(), exercise_.time(), arm(pixels), mode, seed);
}

const Camera::Masks& Episode::masks(int pixels) {
    return camera().masks(simulation(), exercise_.time(), arm(pixels));
}

void Episode::save(const std::filesystem::path& path, script::Origin origin) const {
    exercise::identify(origin, simulation());
    log_.save(path, origin, hash());
}

script::Command parse_line(const std::string& line) {
    const auto refuse = [&line](const std::string& why) {
        throw io::InputError(fmt::format("'{}': {}", line, why));
    };
    if (line.find_first_of("\r\n") != std::string::npos) refuse("one line is accepted");
    script::CommandScript script;
    try {
        script = script::parse_commands("0 " + line, "");  // a script's lines begin with their frame
    } catch (const io::InputError& error) {
        std::string why = error.what();
        // ":1:5: ", a place that is not in what was given
        if (const auto colon = why.find(": "); why.starts_with(":1:") && colon != std::string::npos)
            why.erase(0, colon + 2);
        refuse(why);
    }
    if (script.commands.size() != 1) refuse("one command, such as 'arm lao 30 deg', is accepted");
    return script.commands.front().command;
}

}  // namespace episode
