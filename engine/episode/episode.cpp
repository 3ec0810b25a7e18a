#include "engine/episode/episode.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/score_file.h"
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
        throw io::InputError("an image of {} pixels; expected {} to {} along a side", pixels, fewest_pixels,
                             most_pixels);
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

using Json = nlohmann::ordered_json;

Json number(double value) {
    return std::isnan(value) ? Json(nullptr) : Json(value);
}

/// Adds a field's value under its name.
struct Add {
    Json& json;
    const std::string name;
    const exercise::Simulation& simulation;

    void operator()(std::int64_t value) const { json[name] = value; }
    void operator()(double value) const { json[name] = number(value); }
    void operator()(bool value) const { json[name] = value; }
    void operator()(const exercise::Place& place) const { json[name] = place; }
    void operator()(const exercise::InImage& place) const { json[name] = {place.x, place.y}; }
    void operator()(const exercise::OfDevices& value) const {
        json[name] = value.of[0];
        for (int k = 1; k < script::most_devices; ++k) {
            const auto role = static_cast<script::DeviceRole>(k);
            const std::optional<int> place = simulation.scenario().index_of(role);
            json[fmt::format("{}_{}", script::name_of(role), name)] = place ? value.of[*place] : 0;
        }
    }
    void operator()(exercise::Branch branch) const { json[name] = name_of(branch, simulation.anatomy()); }
    void operator()(script::DeviceRole held) const { json[name] = script::name_of(held); }
};

}  // namespace

exercise::ImagingChain PatientImages::chain(const Simulation& simulation, const anatomy::ModelCache& cache) {
    const std::lock_guard lock(mutex_);
    if (!chain_)
        chain_.emplace(exercise::make_imaging(simulation.scenario(), simulation.anatomy(),
                                              simulation.contrast(), cache));
    return *chain_;
}

render::Fluoroscope PatientImages::masking(const Simulation& simulation) {
    const std::lock_guard lock(mutex_);
    if (chain_) return chain_->fluoroscope;
    if (!masking_)
        masking_.emplace(
            exercise::make_masking(simulation.scenario(), simulation.anatomy(), simulation.contrast()));
    return *masking_;
}

void PatientImages::forget() {
    const std::lock_guard lock(mutex_);
    chain_.reset();
    masking_.reset();
}

Camera::Camera(std::shared_ptr<PatientImages> patient, const anatomy::ModelCache& cache)
    : patient_(std::move(patient)), cache_(cache) {}

exercise::ImagingChain& Camera::chain(const Simulation& simulation) {
    if (!chain_) chain_.emplace(patient_->chain(simulation, cache_));
    still_.reset();
    return *chain_;
}

/// By what the cache has kept; null where that is not enough.
render::Fluoroscope* Camera::still(const Simulation& simulation, const Pulse& pulse) {
    if (chain_ || simulation.contrast().injected() > 0 || exercise::has_contrast(pulse.exposure))
        return nullptr;
    if (!still_ || !(still_arm_ == pulse.arm)) {
        still_.reset();
        auto view = exercise::kept_view(simulation.scenario(), simulation.anatomy(), pulse.arm, cache_);
        if (!view) return nullptr;
        still_arm_ = pulse.arm;
        still_ = render::Fluoroscope::of_view({}, *std::move(view));
    }
    return &*still_;
}

bool Camera::keep_view(const Simulation& simulation, const render::CArm& arm) {
    require_pixels(arm.pixels);
    return exercise::keep_view(simulation.scenario(), simulation.anatomy(), arm,
                               chain(simulation).fluoroscope, cache_);
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
        throw io::InputError("the mode 'screen' was asked for; expected images=True");
    Pulse pulse = this->pulse(simulation, time, arm);
    render::Fluoroscope* seen = still(simulation, pulse);
    if (!seen) {
        const bool knows_organs = chain_.has_value();
        seen = &chain(simulation).fluoroscope;
        if (!knows_organs) pulse = this->pulse(simulation, time, arm);
    }
    render::Fluoroscope& fluoroscope = *seen;
    if (seed) pulse.exposure.seed = *seed;
    exercise::set_mode(pulse, simulation.scenario(),
                       mode == ImageMode::Live   ? script::ImagingMode::Live
                       : mode == ImageMode::Cine ? script::ImagingMode::Cine
                                                 : script::ImagingMode::Dsa);
    if (mode != ImageMode::Dsa) return fluoroscope.expose(pulse.arm, pulse.seen(), pulse.exposure);
    const render::Field signal = signal_of(fluoroscope, pulse, pulse.seen());
    Pulse mask = pulse;
    exercise::remove_contrast(mask);
    mask.devices.clear();
    mask.exposure.frame += mask_frames;
    render::Field before = signal_of(fluoroscope, mask, mask.seen());
    render::Field scatter = fluoroscope.scatter_in(before, mask.arm, mask.exposure);
    const render::Subtraction subtraction(std::move(before), fluoroscope.opening(mask.arm),
                                          std::move(scatter));
    return subtraction.subtracted(signal);
}

const Camera::Masks& Camera::masks(const Simulation& simulation, const exercise::FrameTime& time,
                                   const render::CArm& arm) {
    Pulse pulse = this->pulse(simulation, time, arm);
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    const auto& moves = pulse.exposure.vessel_moves;
    const bool view = masks_ && masked_.arm == pulse.arm && masked_.exposure.vessel_shift == shift &&
                      masked_.exposure.vessel_moves == moves;
    const auto same = [](const exercise::PulsedDevice& a, const exercise::PulsedDevice& b) {
        return a.role == b.role && a.joints == b.joints && a.look == b.look && a.filling == b.filling;
    };
    const bool leaks = !pulse.exposure.clouds.empty();
    if (view && !leaks && !masks_->extravasation && pulse.stents == masked_.stents &&
        std::equal(pulse.devices.begin(), pulse.devices.end(), masked_.devices.begin(), masked_.devices.end(),
                   same))
        return *masks_;
    if (!chain_ && !masking_) masking_.emplace(patient_->masking(simulation));
    render::Fluoroscope& fluoroscope = chain_ ? chain_->fluoroscope : *masking_;
    Masks made = masks_ ? std::move(*masks_) : Masks();
    masks_.reset();
    if (!view) made.vessels = filled(arm.pixels, fluoroscope.vessel_pixels(pulse.arm, shift, moves));
    made.devices.clear();
    for (const exercise::PulsedDevice& device : pulse.devices)
        made.devices.push_back(filled(arm.pixels, exercise::device_pixels(fluoroscope, pulse, device)));
    made.stents.reset();
    if (!pulse.stents.empty()) made.stents = filled(arm.pixels, exercise::stent_pixels(fluoroscope, pulse));
    made.extravasation.reset();
    if (leaks)
        made.extravasation =
            filled(arm.pixels, render::cloud_pixels(arm, pulse.exposure.clouds, exercise::cloud_shows));
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

std::vector<Log::Made> Log::made() const {
    std::vector<Made> made(static_cast<std::size_t>(frames()));
    for (const Entry* entry = last_.get(); entry; entry = entry->before.get())
        made[static_cast<std::size_t>(entry->frame)] = {entry->commands, entry->hash};
    return made;
}

void Log::save(const std::filesystem::path& path, const script::Origin& origin, std::uint64_t hash) const {
    script::Recording recording(path, {origin, hash_every});
    int frame = 0;
    for (const Made& one : made()) recording.frame(frame++, one.commands, [&] { return one.hash; });
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
      patient_(like.patient_),
      start_(like.start_),
      room_(like.room_) {
    reset();
}

/// What a frame would reject when a part of it has taken effect. `start`: the C-arm before these commands.
void Episode::check(std::span<const script::Command> commands, const render::CArm& start) const {
    const scenario::Scenario& scenario = simulation().scenario();
    script::CommandScript asked;
    for (const script::Command& command : commands) {
        if (const std::string wrong = exercise::missing_device(command, scenario); !wrong.empty())
            throw io::InputError(wrong);
        asked.commands.push_back({0, command, {}});
    }
    if (const auto wrong = script::problems(asked, start, scenario.frame_rate); !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
}

void Episode::ask(const script::Command& command) {
    if (asked_.size() == most_asked)
        throw io::InputError("'{}': expected at most {} commands before a step, found one more",
                             script::to_text(command), most_asked);
    // Each is checked once, from where those before it leave the C-arm.
    check({&command, 1}, console().arm());
    asked_.push_back(command);
    follow(command);
}

const exercise::Console& Episode::console() const {
    return asked_console_ ? *asked_console_ : simulation().console();
}

void Episode::follow(const script::Command& command) {
    if (!asked_console_) asked_console_ = simulation().console();
    exercise::Console& console = *asked_console_;
    if (std::holds_alternative<script::Reset>(command)) console = simulation().console();
    if (const auto* move = std::get_if<script::MoveArm>(&command)) console.apply(*move);
    if (const auto* table = std::get_if<script::MoveTable>(&command)) console.apply(*table);
    if (const auto* field = std::get_if<script::Collimate>(&command)) console.apply(*field);
    if (const auto* filter = std::get_if<script::SetFilter>(&command)) console.apply(*filter);
}

render::CArm Episode::arm(int pixels) const {
    render::CArm arm = console().arm();
    arm.pixels = pixels;
    return arm;
}

void Episode::step(std::span<const script::Command> given) {
    std::vector<script::Command> commands = asked_;
    commands.insert(commands.end(), given.begin(), given.end());
    check(commands, simulation().console().arm());
    // These are rejected as they take effect.
    const auto is_uncertain = [](const script::Command& command) {
        return std::holds_alternative<script::Inject>(command) ||
               std::holds_alternative<script::Exchange>(command) ||
               std::holds_alternative<script::Complicate>(command) ||
               std::holds_alternative<script::Relieve>(command);
    };
    const bool uncertain = std::ranges::any_of(commands, is_uncertain);
    const exercise::Exercise::Snapshot before =
        uncertain ? exercise_.snapshot() : exercise::Exercise::Snapshot();
    try {
        const exercise::Frame frame = exercise_.next_frame(commands);
        if (room_) room_->observe(frame, exercise_.score());
    } catch (const io::InputError&) {
        if (uncertain) exercise_.restore(before);
        // One that stayed would be rejected in every later frame, too.
        std::erase_if(asked_, is_uncertain);
        throw;
    }
    for (const script::Command& command : commands)
        if (const auto* exchange = std::get_if<script::Exchange>(&command))
            read_.push_back(
                exercise::file_of_device(exchange->held, exchange->device, simulation().scenario()));
    asked_.clear();
    asked_console_.reset();
    hash_.reset();
    log_.add(std::move(commands), log_.states_next() ? hash() : 0);
}

std::uint64_t Episode::hash() const {
    if (!hash_) hash_ = simulation().state_hash();
    return *hash_;
}

void Episode::show_tip(double margin) {
    const Observation now = reading();
    const geometry::Vec3 tip(now.tip.data());
    const render::CArm arm = this->arm(simulation().scenario().c_arm.pixels);
    const double least = margin * arm.pixels, most = arm.pixels - least;
    const auto seen_with = [&](const Eigen::Vector2d& moved) {
        render::CArm there = arm;
        there.isocentre -= geometry::Vec3(moved.x(), 0, moved.y());
        const render::Pixel pixel = render::project(there, tip);
        return Eigen::Vector2d(pixel.x, pixel.y);
    };
    Eigen::Vector2d moved = Eigen::Vector2d::Zero();  // table to the patient's left and head [mm]
    const Eigen::Vector2d first = seen_with(moved);
    const Eigen::Vector2d wanted = first.cwiseMax(least).cwiseMin(most);
    if (first == wanted) return;
    for (int k = 0; k < 8; ++k) {  // Newton's steps; the image is almost linear in the table's place
        const Eigen::Vector2d at = seen_with(moved);
        Eigen::Matrix2d slope;
        slope << seen_with(moved + Eigen::Vector2d::UnitX()) - at,
            seen_with(moved + Eigen::Vector2d::UnitY()) - at;
        moved += slope.completeOrthogonalDecomposition().solve(wanted - at);
    }
    const geometry::Vec3 table = console().table() + geometry::Vec3(moved.x(), 0, moved.y());
    ask(script::MoveTable{table.cwiseMax(-script::table_reach).cwiseMin(script::table_reach)});
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
    Snapshot made = {exercise_.snapshot(), log_, asked_};
    if (room_) made.room = geometry::state_of(*room_);
    return made;
}

void Episode::restore(const Snapshot& snapshot) {
    exercise_.restore(snapshot.exercise);
    log_ = snapshot.log;
    asked_ = snapshot.asked;
    asked_console_.reset();
    for (const script::Command& command : asked_) follow(command);
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
    if (!room_) throw io::InputError("the panel was asked for; expected an environment made with panel=True");
    const exercise::Monitor* const monitor = exercise_.monitor();
    const exercise::Dose* const dose = exercise_.dose();
    const exercise::Frame frame{exercise_.time(), {}, exercise::StepReport(), simulation(), monitor, dose};
    const render::GrayImage image =
        monitor
            ? exercise_.image()
            : (with ? *with : camera())
                  .image(simulation(), frame.time, arm(drawn.live_area(1, 1).width), ImageMode::Live, seed);
    return drawn.draw(image, monitor ? monitor->reference() : nullptr, room_->read(frame, exercise_.score()));
}

Camera& Episode::camera() {
    if (!camera_) camera_ = std::make_unique<Camera>(patient_, cache_);
    return *camera_;
}

render::GrayImage Episode::image(int pixels, ImageMode mode, std::optional<std::uint64_t> seed) {
    if (mode == ImageMode::Screen && exercise_.monitor()) {
        render::GrayImage shown = exercise_.image();
        if (pixels != shown.width)
            throw io::InputError("the screen in {} pixels was asked for; it has {} along a side", pixels,
                                 shown.width);
        return shown;
    }
    return camera().image(simulation(), exercise_.time(), arm(pixels), mode, seed);
}

bool Episode::keep_view(int pixels) {
    return camera().keep_view(simulation(), arm(pixels));
}

const Camera::Masks& Episode::masks(int pixels) {
    return camera().masks(simulation(), exercise_.time(), arm(pixels));
}

void Episode::save(const std::filesystem::path& path, script::Origin origin) const {
    require_no_input("save", path);
    exercise::identify(origin, simulation());
    log_.save(path, origin, hash());
}

void Episode::require_no_input(const std::string& what, const std::filesystem::path& path) const {
    std::vector<std::filesystem::path> more = read_;
    std::error_code ignored;
    if (std::filesystem::is_regular_file("/dev/stdin", ignored)) more.emplace_back("/dev/stdin");
    scenario::require_no_input({{what, path}}, simulation().scenario(), std::move(more));
}

Observation Episode::reading() const {
    Observation r = reader_.read(exercise_);
    const render::CArm arm = this->arm(simulation().scenario().c_arm.pixels);
    const auto in_image = [&arm](const exercise::Place& place) {
        const render::Pixel pixel = render::project(arm, {place[0], place[1], place[2]});
        return exercise::InImage{pixel.x, pixel.y};
    };
    r.tip_px = in_image(r.tip);
    r.target_px = in_image(r.target);
    return r;
}

Observation Episode::full_reading() const {
    Observation r = reading();
    Reader::read_errors(simulation(), r);
    return r;
}

namespace {

std::vector<double> places_of(const Episode& episode, script::DeviceRole held) {
    const Simulation& simulation = episode.simulation();
    std::vector<double> numbers;
    const geometry::Vec3 shift = simulation.vessel_shift();
    const geometry::Polyline joints = simulation.carried_path_of(held);
    numbers.reserve(3 * joints.size());
    for (const geometry::Vec3& joint : joints) {
        const geometry::Vec3 place = joint + shift;
        numbers.insert(numbers.end(), place.begin(), place.end());
    }
    return numbers;
}

std::vector<double> in_image(const render::CArm& arm, const std::vector<double>& places) {
    std::vector<double> numbers;
    numbers.reserve(places.size());
    for (std::size_t i = 0; i < places.size(); i += 3) {
        const render::Pixel pixel = render::project(arm, {places[i], places[i + 1], places[i + 2]});
        numbers.push_back(pixel.x);
        numbers.push_back(pixel.y);
    }
    return numbers;
}

template <script::DeviceRole held>
std::vector<double> joints(const Episode& episode, const render::CArm&) {
    return places_of(episode, held);
}
template <script::DeviceRole held>
std::vector<double> pixels(const Episode& episode, const render::CArm& arm) {
    return in_image(arm, places_of(episode, held));
}
std::vector<double> forces(const Episode& episode, const render::CArm&) {
    std::vector<double> numbers;
    for (const physics::WallContact& contact : episode.simulation().contacts())
        numbers.push_back(contact.force());
    return numbers;
}

constexpr ListField lists[] = {
    {"wire_mm", "mm", "joints of the wire from the introducer to its tip; none where it is out", 3,
     joints<script::DeviceRole::Wire>},
    {"wire_px", "pixels", "the same joints in the image", 2, pixels<script::DeviceRole::Wire>},
    {"microcatheter_mm", "mm", "of the microcatheter; none without one, or where it is out", 3,
     joints<script::DeviceRole::Microcatheter>},
    {"microcatheter_px", "pixels", "the same joints in the image", 2,
     pixels<script::DeviceRole::Microcatheter>},
    {"intermediate_mm", "mm", "of the intermediate catheter; none without one, or where it is out", 3,
     joints<script::DeviceRole::Intermediate>},
    {"intermediate_px", "pixels", "the same joints in the image", 2,
     pixels<script::DeviceRole::Intermediate>},
    {"balloon_mm", "mm", "of the balloon's catheter; none without one, or where it is out", 3,
     joints<script::DeviceRole::Balloon>},
    {"balloon_px", "pixels", "the same joints in the image", 2, pixels<script::DeviceRole::Balloon>},
    {"catheter_mm", "mm", "joints of the catheter; none without one, or where it is out", 3,
     joints<script::DeviceRole::Catheter>},
    {"catheter_px", "pixels", "the same joints in the image", 2, pixels<script::DeviceRole::Catheter>},
    {"sheath_mm", "mm", "of the sheath; none without one, or where it is out", 3,
     joints<script::DeviceRole::Sheath>},
    {"sheath_px", "pixels", "the same joints in the image", 2, pixels<script::DeviceRole::Sheath>},
    {"joint_force_N", "N", "force on the wall of each joint of the chain of devices", 1, forces},
};

}  // namespace

std::span<const ListField> list_fields() {
    return lists;
}

script::Command parse_line(const std::string& line) {
    const auto refuse = [&line](const std::string& why) { throw io::InputError("'{}': {}", line, why); };
    if (line.find_first_of("\r\n") != std::string::npos) refuse("expected one line");
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
    if (script.commands.size() != 1) refuse("expected one command, such as 'arm lao 30 deg'");
    return script.commands.front().command;
}

std::string to_json(const Episode& episode) {
    const exercise::Simulation& simulation = episode.simulation();
    const Observation reading = episode.full_reading();
    const render::CArm arm = episode.arm(simulation.scenario().c_arm.pixels);
    Json json;
    for (const exercise::Field& field : exercise::fields()) {
        if (field.name.empty()) continue;
        const Add add{json, std::string(field.name), simulation};
        std::visit([&](const auto member) { add(reading.*member); }, field.member);
    }
    for (const ListField& field : list_fields()) {
        Json rows = Json::array();
        const std::vector<double> numbers = field.of(episode, arm);
        const auto columns = static_cast<std::size_t>(field.columns);
        for (std::size_t i = 0; i < numbers.size(); i += columns)
            rows.push_back(
                columns == 1 ? Json(numbers[i])
                             : Json(std::vector<double>(numbers.begin() + i, numbers.begin() + i + columns)));
        json[std::string(field.name)] = std::move(rows);
    }
    json["hash"] = io::hash_text(episode.hash());
    return json.dump();
}

namespace {

/// The schema of a field's value.
struct Describe {
    static Json array(int count) {
        return {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", count}, {"maxItems", count}};
    }
    Json operator()(std::int64_t Observation::*) const { return {{"type", "integer"}}; }
    Json operator()(double Observation::*) const { return {{"type", {"number", "null"}}}; }
    Json operator()(bool Observation::*) const { return {{"type", "boolean"}}; }
    Json operator()(exercise::Place Observation::*) const { return array(3); }
    Json operator()(exercise::InImage Observation::*) const { return array(2); }
    Json operator()(exercise::OfDevices Observation::*) const { return {{"type", "number"}}; }
    Json operator()(exercise::Branch Observation::*) const { return {{"type", "string"}}; }
    Json operator()(script::DeviceRole Observation::*) const { return {{"enum", script::device_names()}}; }
};

}  // namespace

std::string schema_of_lines() {
    Json state = {{"type", "object"}, {"additionalProperties", false}};
    for (const exercise::Field& field : exercise::fields()) {
        if (field.name.empty()) continue;
        const std::string name(field.name);
        Json value = std::visit(Describe(), field.member);
        std::string text(field.doc);
        if (!field.unit.empty()) text += fmt::format(" [{}]", field.unit);
        value["description"] = text;
        // Of other devices where the scenario has them.
        if (std::holds_alternative<exercise::OfDevices Observation::*>(field.member))
            for (int k = 1; k < script::most_devices; ++k)
                state["properties"][fmt::format("{}_{}", script::name_of(static_cast<script::DeviceRole>(k)),
                                                name)] = value;
        state["properties"][name] = std::move(value);
        state["required"].push_back(name);
    }
    for (const ListField& field : list_fields()) {
        Json value = {
            {"type", "array"},
            {"items", field.columns == 1 ? Json{{"type", "number"}} : Describe::array(field.columns)},
            {"description", fmt::format("{} [{}]", field.doc, field.unit)}};
        state["properties"][std::string(field.name)] = std::move(value);
        state["required"].push_back(field.name);
    }
    state["properties"]["hash"] = {{"type", "string"}, {"pattern", "^[0-9a-f]{16}$"}};
    state["required"].push_back("hash");
    const auto only = [](const char* key, Json value) {
        return Json{{"type", "object"},
                    {"properties", {{key, std::move(value)}}},
                    {"required", {key}},
                    {"additionalProperties", false}};
    };
    const Json text = {{"type", "string"}};
    Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                   {"title", "A line of seldinger serve"},
                   {"oneOf",
                    {{{"$ref", "#/$defs/state"}},
                     {{"$ref", "#/$defs/score"}},
                     only("error", text),
                     only("kept", {{"type", "integer"}, {"minimum", 0}}),
                     only("image", text),
                     only("saved", text)}}};
    schema["$defs"]["state"] = std::move(state);
    schema["$defs"]["score"] = {{"type", "object"},
                                {"required", {"schema", "program", "scenario"}},
                                {"description", "as assets/score.schema.json"}};
    return schema.dump(2);
}

std::string score_line(const Episode& episode, const std::string& program) {
    const exercise::Exercise& exercise = episode.exercise();
    return Json::parse(exercise::to_json({program,
                                          {},
                                          exercise.finish(),
                                          exercise.earlier_attempts(),
                                          exercise.simulation().scenario().lesson.benchmark}))
        .dump();
}

std::string quoted(const std::string& text) {
    return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace episode
