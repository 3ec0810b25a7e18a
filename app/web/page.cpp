/// What the page's worker calls: the room of the engine, with answers as JSON.

#include "engine/debrief/page.h"

#include <algorithm>
#include <chrono>
#include <emscripten.h>
#include <exception>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/web/page_json.h"
#include "engine/debrief/course.h"
#include "engine/debrief/course_page.h"
#include "engine/debrief/story.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/grade.h"
#include "engine/exercise/score_file.h"
#include "engine/exercise/transport.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/room/patient_mesh.h"
#include "engine/room/session.h"
#include "engine/room/way_map.h"
#include "engine/room/words.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "physics/geometry/state.h"
#include "render/panel/readout.h"
#include "render/xray/path_length.h"

namespace app {
namespace {

using room::Action;
using room::Control;
using room::Phase;

constexpr const char *scenarios = "/assets/scenarios", *devices = "/assets/devices",
                     *scripts = "/assets/scripts", *attempts = "/attempts";
constexpr const char* program = "seldinger " SELDINGER_VERSION " (page)";
constexpr std::array<const char*, 6> phases = {"loading", "ready", "running", "paused", "ended", "failed"};

anatomy::ModelCache baked() {
    anatomy::ModelCache cache;
    cache.folder = "/cache";
    return cache;
}

// clang-format off
EM_JS(void, tell_progress, (double part, const char* doing), {
    if (Module.progress) Module.progress(part, UTF8ToString(doing));
});
// clang-format on

/// The answer lives until the next call.
const char* answer(const Json& json) {
    static std::string text;
    text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    return text.c_str();
}

/// Calls `work`, whose errors become {"error": "…"}.
template <class Work>
const char* answered(const Work& work) {
    try {
        return answer(work());
    } catch (const std::exception& error) {
        return answer({{"error", error.what()}});
    }
}

/// The page has one room.
class Room {
public:
    static Room& get() {
        static Room room;
        return room;
    }

    Json begin() {
        keys_ = room::load_keys("/assets/keys.toml");
        Json exercises = Json::array();
        for (const std::filesystem::path& file : scenario_files()) {
            const scenario::Scenario s = scenario::load_scenario(file, devices, {});
            std::error_code ignored;
            Json patients = Json::array();
            for (std::size_t k = 0; k < s.lesson.patients.size(); ++k)
                patients.push_back({{"word", std::to_string(k + 2)}, {"who", s.lesson.patients[k].who}});
            exercises.push_back({{"name", s.name},
                                 {"title", s.title},
                                 {"level", s.lesson.level},
                                 {"summary", s.lesson.indication},
                                 {"picture", "pictures/" + s.name + ".png"},
                                 {"devices", s.devices.size()},
                                 {"guided", s.lesson.guided()},
                                 {"solution", std::filesystem::exists(solution(s.name), ignored)},
                                 {"benchmark", s.lesson.benchmark.given()},
                                 {"patients", patients}});
        }
        // In the order of the course; those outside it last.
        std::stable_sort(exercises.begin(), exercises.end(), [](const Json& a, const Json& b) {
            const auto level = [](const Json& e) { return e["level"] == 0 ? 99 : e["level"].get<int>(); };
            return level(a) < level(b);
        });
        return {{"version", SELDINGER_VERSION},
                {"pass", exercise::pass_mark},
                {"exercises", exercises},
                {"keys", keys()},
                {"software", render::usual_rasteriser() == render::Rasteriser::Processor}};
    }

    Json open(const Json& wanted) {
        session_.reset();
        view_.reset();
        sent_ = -1, image_ = reference_ = -1;
        scale_ = {};
        inside_ = Inside();
        is_free_ = wanted.value("free", false);
        is_solution_ = wanted.value("solution", false);
        const std::string name = wanted.at("exercise");
        room::SessionOptions options;
        options.scenario =
            scenario::load_scenario(file_of(name), devices, {}, wanted.value("patient", std::string()));
        options.cache = baked();
        options.keys = keys_;
        options.free_practice = is_free_;
        options.own_thread = false;
        options.wake = [this] {
            if (const auto view = session_ ? session_->view() : nullptr;
                view && view->phase == Phase::Loading)
                tell_progress(view->loading, view->doing.c_str());
        };
        if (is_solution_) options.script = script::load_commands(solution(name));
        is_replay_ = wanted.contains("replay") && wanted["replay"].is_string();
        if (is_replay_) options.script = script::load_commands(wanted["replay"].get<std::string>());
        if (options.script) options.speed = std::clamp(wanted.value("speed", 1.0), 0.1, 100.0);
        if (!options.script) options.record = room::Attempts(attempts);
        options.origin.program = program;
        const std::string learner = wanted.value("learner", "");
        if (!learner.empty() && !script::is_learner(learner))
            throw io::InputError("learner: expected a name of 1 to {} letters, found '{}'",
                                 script::longest_learner, learner);
        options.origin.learner = learner;
        session_ = std::make_unique<room::Session>(std::move(options));
        return Json::object();
    }

    Json close() {
        session_.reset();
        view_.reset();
        return Json::object();
    }

    /// {"next": ms until it is to be called again, or null; "view": {…} where it is a new one}.
    Json turn() {
        if (!session_) return {{"next", nullptr}};
        const std::optional<room::Clock::time_point> next = session_->turn();
        Json made;
        const std::chrono::duration<double, std::milli> left =
            next ? *next - room::Clock::now() : std::chrono::duration<double, std::milli>(0);
        made["next"] = next ? Json(std::max(0.0, left.count())) : Json();
        const auto view = session_->view();
        if (view->serial == sent_) return made;
        sent_ = view->serial;
        view_ = view;
        made["view"] = shown();
        return made;
    }

    Json give(const Json& given) {
        if (!session_) return Json::object();
        room::Input input;
        for (const auto& name : given.value("held", Json::array()))
            if (const auto action = action_of(name)) input.held.set(static_cast<std::size_t>(*action));
        for (const auto& name : given.value("pressed", Json::array()))
            if (const auto action = action_of(name)) input.pressed.push_back(*action);
        for (const auto& which : given.value("injections", Json::array())) {
            const int k = which.get<int>();
            if (k >= 0 && k < static_cast<int>(keys_.injections.size())) input.injections.push_back(k);
        }
        const auto amount = [&](const char* name, double most) {
            const double value = given.value(name, 0.0);
            return std::isfinite(value) ? std::clamp(value, -most, most) : 0.0;
        };
        input.wheel = amount("wheel", 100);
        input.drag_up = amount("dragUp", 1e4), input.drag_right = amount("dragRight", 1e4);
        input.arm_lao = amount("armLao", 10), input.arm_cranial = amount("armCranial", 10);
        input.table_left = amount("tableLeft", 1000), input.table_head = amount("tableHead", 1000);
        const auto stick = [&](const char* name, std::array<double, 2>& to) {
            const Json both = given.value(name, Json::array());
            for (std::size_t k = 0; k < std::min<std::size_t>(2, both.size()); ++k)
                if (both[k].is_number()) to[k] = std::clamp(both[k].get<double>(), -1.0, 1.0);
        };
        stick("push", input.push);
        stick("turn", input.turn);
        session_->give(input);
        return Json::object();
    }

    Json control(const std::string& word) {
        static const std::vector<std::pair<std::string, Control>> words = {
            {"start", Control::Start},       {"pause", Control::Pause},   {"resume", Control::Resume},
            {"takeBack", Control::TakeBack}, {"finish", Control::Finish}, {"skipStep", Control::SkipStep}};
        if (!session_) return Json::object();
        if (word == "lookInside" || word == "lookAway") return look_inside(word == "lookInside");
        for (const auto& [name, control] : words)
            if (name == word) session_->give(control);
        if (const auto action = action_of(word)) session_->did(*action);
        return Json::object();
    }

    /// How many times faster than it was made a solution or a recording is shown.
    Json speed(double factor) {
        if (session_ && std::isfinite(factor)) session_->show_at(std::clamp(factor, 0.1, 100.0));
        return Json::object();
    }

    Json briefing() const {
        const scenario::Scenario& s = open_session().options().scenario;
        const auto anatomy = open_session().anatomy();
        Json lines = Json::array();
        for (const auto& [name, value] : room::briefing(s)) lines.push_back({name, value});
        return {{"exercise", s.name},
                {"title", s.title},
                {"indication", s.lesson.indication},
                {"briefing", s.lesson.briefing},
                {"lines", lines},
                {"patient", s.patient},
                {"map", anatomy ? map_of(room::way_map(s, *anatomy, s.c_arm)) : Json()},
                {"judgement", is_free_ ? "" : room::judgement(s)},
                {"hints", s.lesson.hints},
                {"keys", room::keys_line(keys_, s)},
                {"guided", s.lesson.guided()},
                {"free", is_free_},
                {"solution", is_solution_}};
    }

    Json end() const {
        const scenario::Scenario& s = open_session().options().scenario;
        if (!view_) throw io::InputError("no attempt has been made");
        const room::View& view = *view_;
        const exercise::Score& score = view.score;
        const bool graded = s.lesson.benchmark.given() && !is_free_ && !s.lesson.guided() && !view.tuned;
        std::optional<exercise::Grade> grade;
        if (graded) grade = exercise::grade(score, s.lesson.benchmark);
        const bool shows_script = is_solution_ || is_replay_;
        const bool passed = room::is_lesson_passed(view) || (grade && grade->points >= exercise::pass_mark);
        Json notes = Json::array();
        if (grade && !shows_script) notes = notes_of(*grade, s);
        if (!graded && !is_free_ && !s.lesson.guided()) notes.push_back(room::without_benchmark(score));
        if (is_replay_ && view.differences.empty())
            notes.push_back("Every recorded state was reached to the bit.");
        const std::optional<exercise::Grade> told = score.completed ? grade : std::nullopt;
        return {{"exercise", s.name},
                {"title", is_solution_ ? "That was the solution. Your turn."
                          : is_replay_ ? "The recording ends here"
                                       : room::outcome(view, told, is_free_)},
                {"tone", shows_script || is_free_    ? "plain"
                         : passed || score.completed ? "good"
                                                     : "caution"},
                {"subtitle", s.title + (s.patient.empty() ? "" : ", " + s.patient_text())},
                {"lines", grade ? grade_lines(*grade) : Json::array()},
                {"notes", notes},
                {"events", is_solution_                    ? captions()
                           : is_free_ || s.lesson.guided() ? Json::array()
                                                           : events_of(view)},
                {"timesOpen", room::times_open},
                {"points", grade ? Json(grade->points) : Json()},
                {"passed", passed},
                {"reached", score.completed},
                {"seconds", number(score.completed_after)},
                {"formula", exercise::grade_formula},
                {"file", view.recorded.string()}};
    }

    Json look(const Json& wanted) {
        const int number = wanted.value("run", 0);
        const room::Sequence& run = run_of(number);
        room::Look look;
        const int last = static_cast<int>(run.images.size()) - 1;
        look.image = static_cast<std::size_t>(std::clamp(wanted.value("image", last), 0, last));
        look.mask = static_cast<std::size_t>(std::clamp(wanted.value("mask", 0), 0, last));
        look.shift_x = wanted.value("shiftX", 0.0), look.shift_y = wanted.value("shiftY", 0.0);
        look.window = wanted.value("window", 256.0), look.level = wanted.value("level", 128.0);
        looked_ = std::make_shared<const render::GrayImage>(room::look_at(run, look));
        return {{"run", number},
                {"image", look.image},
                {"count", run.images.size()},
                {"width", looked_->width},
                {"height", looked_->height}};
    }

    /// What a ruler on an image of a run measures. "calibrate": it lies across the wire in what look() shows
    /// of the same; "isocentre": no longer by the wire.
    Json measure(const Json& wanted) {
        const room::Sequence& run = run_of(wanted.value("run", 0));
        const auto end = [&](int k) { return std::clamp(wanted.at("ruler").at(k).get<double>(), -1e4, 1e4); };
        const room::Ruler ruler{end(0), end(1), end(2), end(3)};
        if (wanted.value("isocentre", false)) scale_.calibrated.reset();
        if (wanted.value("calibrate", false)) {
            look(wanted);
            scale_.calibrate(*looked_, ruler, open_session().options().scenario.wire().device.outer_diameter);
        }
        return {{"length", scale_.length(run, ruler)},
                {"scale", scale_.text(run)},
                {"found", scale_.found},
                {"calibrated", scale_.calibrated.has_value()}};
    }

    /// What is new in the view into the patient: {"centre": […], "shift": […], "meshes": [{"name",
    /// "vertices", "indices", "lines", "opacity", "rim"}…]}, to be fetched by mesh(); at first with what
    /// never changes.
    Json inside() {
        const auto anatomy = session_ ? session_->anatomy() : nullptr;
        if (!inside_.watched || !view_ || !anatomy) return Json::object();
        const scenario::Target& goal = session_->options().scenario.target;
        const geometry::Vec3 target = room::target_of(goal, *anatomy);
        const room::SolverView* solver = view_->solver.get();
        Json made = Json::object(), meshes = Json::array();
        const auto now = room::Clock::now();
        inside_.meshes.clear();
        const auto add = [&](const char* name, room::PatientMesh mesh, room::Veil veil, bool lines) {
            meshes.push_back({{"name", name},
                              {"vertices", mesh.vertices.size()},
                              {"indices", mesh.indices.size()},
                              {"lines", lines},
                              {"opacity", veil.opacity},
                              {"rim", veil.rim}});
            inside_.meshes.push_back(std::move(mesh));
        };
        const bool first = !inside_.sent;
        if (first) {
            inside_.sent = true;
            add("target", room::target_mesh(target, goal.radius), room::target_veil, false);
            const room::Eye eye;
            made["shaders"] = {room::patient_vertex_shader, room::patient_fragment_shader};
            made["eye"] = {{"azimuth", eye.azimuth},   {"elevation", eye.elevation},
                           {"distance", eye.distance}, {"steepest", eye.steepest},
                           {"nearest", eye.nearest},   {"farthest", eye.farthest},
                           {"field", eye.field}};
            made["legend"] = room::force_legend();
            Json shades = Json::array();
            for (int k = 0; k <= 8; ++k) {
                const render::Ink ink = room::legend_colour(k / 8.0);
                shades.push_back({ink.red, ink.green, ink.blue});
            }
            made["shades"] = shades;
        }
        // Walls that give way move at each frame: the eye is content with fewer.
        const std::vector<Eigen::Vector3f> moves =
            solver ? solver->lumen_moves : std::vector<Eigen::Vector3f>();
        if (first || (moves != inside_.moves && now - inside_.lumen_at > std::chrono::milliseconds(250))) {
            inside_.moves = moves;
            inside_.lumen_at = now;
            add("lumen", room::lumen_mesh(*anatomy, moves), room::lumen_veil, false);
        }
        geometry::Vec3 centre = target, shift = geometry::Vec3::Zero();
        if (solver && !solver->joints.empty()) {
            add("devices", room::device_mesh(*solver), room::solid, false);
            add("forces", room::force_lines(*solver), room::solid, true);
            shift = solver->shift;
            centre = solver->joints.back() + shift;
        }
        made["centre"] = {centre.x(), centre.y(), centre.z()};
        made["shift"] = {shift.x(), shift.y(), shift.z()};
        made["meshes"] = meshes;
        return made;
    }
    /// Nine floats of each vertex, or the indices, of a mesh that inside() told of.
    const void* mesh(int which, bool indices) const {
        if (which < 0 || which >= static_cast<int>(inside_.meshes.size())) return nullptr;
        const room::PatientMesh& found = inside_.meshes[static_cast<std::size_t>(which)];
        return indices ? static_cast<const void*>(found.indices.data()) : found.vertices.data();
    }

    /// Puts what `seldinger bake --for-web` packed into the cache: the names of its files.
    static Json unpack(const std::filesystem::path& file) {
        const std::string bytes =
            io::read_text(file, "an exercise's files", "expected those of 'seldinger bake --for-web'");
        Json names = Json::array();
        for (const exercise::CarriedFile& carried :
             exercise::unpacked_from_transport(std::as_bytes(std::span(bytes)))) {
            const std::filesystem::path to = std::filesystem::path(baked().folder) / carried.name;
            io::write_whole(to, carried.bytes);
            names.push_back(to.string());
        }
        return names;
    }

    /// Writes the page about a recording of an exercise into `to`.
    static Json debrief(const Json& wanted) {
        const std::string recording = wanted.at("recording");
        debrief::StoryOptions options;
        options.cache = baked();
        options.progress = [](double part, const char* what) { tell_progress(part, what); };
        const script::CommandScript script = script::load_commands(recording);
        auto story = debrief::tell(scenario_of(wanted.at("exercise"), script), script, options);
        if (!story) throw io::InputError("the debriefing was interrupted");
        story->file = wanted.value("name", recording);
        io::write_whole(wanted.at("to").get<std::string>(), debrief::page(std::span(&*story, 1), nullptr));
        return Json::object();
    }

    /// Figures of recordings, which are kept; with "to" the teacher's page about them, written there.
    static Json course(const Json& wanted) {
        std::vector<std::filesystem::path> files;
        for (const std::string file : wanted.at("files")) files.emplace_back(file);
        debrief::CourseOptions options;
        options.scenario = [](const script::CommandScript& recording) {
            const std::string name = recording.origin ? recording.origin->scenario : "";
            std::error_code ignored;
            if (!std::filesystem::exists(file_of(name), ignored))
                throw io::InputError("its exercise '{}' is none of this page's", name);
            return scenario_of(name, recording);
        };
        options.cache = baked();
        options.program_hash = program;
        options.jobs = 1;
        options.progress = [](std::size_t done, std::size_t of) {
            tell_progress(static_cast<double>(done) / static_cast<double>(of), "playing the recordings");
        };
        const auto rows = debrief::course_of(files, options);
        if (!rows) throw io::InputError("the course was interrupted");
        if (wanted.contains("to")) {
            std::vector<scenario::Scenario> all;
            for (const std::filesystem::path& file : scenario_files())
                all.push_back(scenario::load_scenario(file, devices, {}));
            std::ranges::stable_sort(all, {}, [](const scenario::Scenario& s) { return s.lesson.level; });
            io::write_whole(
                wanted["to"].get<std::string>(),
                debrief::course_page(*rows, debrief::usual_plan(all), wanted.value("title", "Course"),
                                     debrief::day_of(std::chrono::system_clock::now())));
        }
        return {{"attempts", rows->size()}};
    }

    /// The exercise that a recording names.
    static Json exercise_of(const std::string& recording) {
        const script::CommandScript script = script::load_commands(recording);
        if (!script.origin || script.origin->scenario.empty())
            throw io::InputError("{}: expected a recording that names its exercise", recording);
        return {{"exercise", script.origin->scenario},
                {"learner", script.origin->learner},
                {"patient", script.origin->patient}};
    }

    const std::uint8_t* pixels(int which) const {
        const std::shared_ptr<const render::GrayImage> image = which == 2   ? looked_
                                                               : !view_     ? nullptr
                                                               : which == 1 ? view_->reference
                                                                            : view_->image;
        return image ? image->pixels.data() : nullptr;
    }

private:
    static std::vector<std::filesystem::path> scenario_files() {
        std::vector<std::filesystem::path> files;
        for (const auto& entry : std::filesystem::directory_iterator(scenarios))
            if (entry.path().extension() == ".toml" && entry.path().stem() != "benchmark")
                files.push_back(entry.path());
        std::ranges::sort(files);
        return files;
    }
    static scenario::Scenario scenario_of(const std::string& name, const script::CommandScript& recording) {
        return scenario::load_scenario(file_of(name), devices, {},
                                       recording.origin ? recording.origin->patient : std::string());
    }
    static std::filesystem::path file_of(const std::string& name) {
        return std::filesystem::path(scenarios) / (name + ".toml");
    }
    static std::filesystem::path solution(const std::string& name) {
        return std::filesystem::path(scripts) / (name + ".gw");
    }
    const room::Session& open_session() const {
        if (!session_) throw io::InputError("no exercise is open");
        return *session_;
    }
    const room::Sequence& run_of(int number) const {
        if (!view_) throw io::InputError("no run has been taken");
        for (const auto& run : view_->runs)
            if (run->number == number && !run->images.empty()) return *run;
        throw io::InputError("expected the number of a run, found {}", number);
    }

    /// The view into the patient shows what the trainee has to find: the recording and the score say so, as
    /// of a teacher who does it.
    Json look_inside(bool is) {
        inside_.watched = is;
        inside_.sent = false;
        script::TeacherScreen screen = script::usual_screen;
        using Thing = script::TeacherAct::Thing;
        for (const Thing thing : {Thing::Target, Thing::Window}) screen[static_cast<std::size_t>(thing)] = is;
        session_->give(screen);
        session_->give(is ? Control::WatchDevices : Control::WatchNothing);
        return Json::object();
    }

    static std::optional<Action> action_of(const std::string& name) {
        for (int k = 0; k < room::actions; ++k)
            if (room::info(static_cast<Action>(k)).key == name) return static_cast<Action>(k);
        return {};
    }

    Json keys() const {
        Json keys = Json::array(), actions = Json::array(), injections = Json::array();
        const auto& names = room::key_names();
        for (std::size_t key = 0; key < names.size(); ++key) {
            Json does = Json::array();
            for (int k = 0; k < room::actions; ++k)
                if (const auto& of = keys_.keys[static_cast<std::size_t>(k)];
                    std::ranges::find(of, static_cast<room::Key>(key)) != of.end())
                    does.push_back(room::info(static_cast<Action>(k)).key);
            if (!does.empty())
                keys.push_back({{"key", names[key]},
                                {"label", keys_.label(static_cast<room::Key>(key))},
                                {"actions", does}});
        }
        for (int k = 0; k < room::actions; ++k) {
            const room::ActionInfo& info = room::info(static_cast<Action>(k));
            actions.push_back({{"name", info.key},
                               {"title", info.help},
                               {"held", static_cast<Action>(k) < room::first_pressed},
                               {"task", room::task_names[static_cast<std::size_t>(info.task)]}});
        }
        for (const room::InjectionPreset& preset : keys_.injections)
            injections.push_back({{"key", keys_.label(preset.key)}, {"text", room::sentence_of(preset)}});
        return {{"keys", keys},
                {"injections", injections},
                {"actions", actions},
                {"deadZone", keys_.speeds.dead_zone}};
    }

    /// What a solution says of itself, at its times.
    Json captions() const {
        const room::SessionOptions& options = open_session().options();
        Json made = Json::array();
        for (const script::Caption& caption : options.script->captions)
            made.push_back({{"time", render::clock_text(caption.frame / options.scenario.frame_rate)},
                            {"what", caption.text},
                            {"advice", ""},
                            {"kind", "caption"}});
        return made;
    }
    /// What it says now.
    std::string caption() const {
        std::string text;
        if (is_solution_)
            for (const script::Caption& caption : open_session().options().script->captions)
                if (caption.frame <= view_->frames) text = caption.text;
        return text;
    }

    /// The view for the page; images are fetched by pixels() where they are named.
    Json shown() {
        const room::View& view = *view_;
        const render::Readout& r = view.readout;
        const double contrast_left = r.contrast_limit.value_or(0) - r.contrast.value_or(0);
        Json made = {{"phase", phases[static_cast<std::size_t>(view.phase)]},
                     {"part", view.loading},
                     {"doing", view.doing},
                     {"error", view.error},
                     {"frame", view.frames},
                     {"serial", view.serial},
                     {"readout", readout_of(r)},
                     {"strip",
                      {{"time", render::clock_text(r.time)},
                       {"beam", fmt::format("{:.0f} s", view.score.beam_on_time)},
                       {"dose", render::figure_text(r.air_kerma, 1) + " mGy"},
                       {"contrast", fmt::format("{:.0f} ml", r.contrast.value_or(0))},
                       {"contrastLow", contrast_left < 20},
                       {"errors", view.score.handling_errors.size()}}},
                     {"slow", view.slow},
                     {"lost", view.lost_frames},
                     {"recording", view.recording},
                     {"tuned", view.tuned},
                     {"differences", view.differences},
                     {"takenBack", view.taken_back},
                     {"caption", caption()},
                     {"guide", view.guide ? guide_of(*view.guide, keys_) : Json()},
                     {"runs", runs_of(view)}};
        if (view.image_serial != image_) {
            image_ = view.image_serial;
            made["image"] = size_of(view.image);
        }
        const auto reference = reinterpret_cast<std::intptr_t>(view.reference.get());
        if (reference != reference_) {
            reference_ = reference;
            made["reference"] = size_of(view.reference);
        }
        return made;
    }

    room::KeyMap keys_;
    std::unique_ptr<room::Session> session_;
    std::shared_ptr<const room::View> view_;
    std::shared_ptr<const render::GrayImage> looked_;
    long sent_ = -1, image_ = -1;
    std::intptr_t reference_ = -1;
    bool is_free_ = false, is_solution_ = false, is_replay_ = false;
    room::Scale scale_;  // of the ruler
    struct Inside {      // the view into the patient
        bool watched = false, sent = false;
        std::vector<room::PatientMesh> meshes;
        std::vector<Eigen::Vector3f> moves;
        room::Clock::time_point lumen_at;
    } inside_;
};

}  // namespace
}  // namespace app

extern "C" {

/// What there is: exercises in the order of the course, keys.
EMSCRIPTEN_KEEPALIVE const char* seldinger_begin() {
    return app::answered([] { return app::Room::get().begin(); });
}
/// Opens an exercise: {"exercise": "renal", "free": false, "solution": false, "learner": "", "speed": 1,
/// "replay": FILE, "patient": "2"}.
EMSCRIPTEN_KEEPALIVE const char* seldinger_open(const char* wanted) {
    return app::answered([&] { return app::Room::get().open(app::Json::parse(wanted)); });
}
EMSCRIPTEN_KEEPALIVE const char* seldinger_close() {
    return app::answered([] { return app::Room::get().close(); });
}
EMSCRIPTEN_KEEPALIVE const char* seldinger_turn() {
    return app::answered([] { return app::Room::get().turn(); });
}
EMSCRIPTEN_KEEPALIVE const char* seldinger_give(const char* input) {
    return app::answered([&] { return app::Room::get().give(app::Json::parse(input)); });
}
/// "start", "pause", "resume", "takeBack", "finish", "skipStep", "lookInside", "lookAway", or an action that
/// the page did by itself.
EMSCRIPTEN_KEEPALIVE const char* seldinger_control(const char* word) {
    return app::answered([&] { return app::Room::get().control(word); });
}
EMSCRIPTEN_KEEPALIVE const char* seldinger_briefing() {
    return app::answered([] { return app::Room::get().briefing(); });
}
EMSCRIPTEN_KEEPALIVE const char* seldinger_end() {
    return app::answered([] { return app::Room::get().end(); });
}
/// {"run": 1, "image": 5, "mask": 0, "shiftX": 0, "shiftY": 0, "window": 256, "level": 128}.
EMSCRIPTEN_KEEPALIVE const char* seldinger_look(const char* wanted) {
    return app::answered([&] { return app::Room::get().look(app::Json::parse(wanted)); });
}
/// As for seldinger_look(), and {"ruler": [x0, y0, x1, y1], "calibrate": false, "isocentre": false}, in
/// pixels.
EMSCRIPTEN_KEEPALIVE const char* seldinger_measure(const char* wanted) {
    return app::answered([&] { return app::Room::get().measure(app::Json::parse(wanted)); });
}
EMSCRIPTEN_KEEPALIVE const char* seldinger_speed(double factor) {
    return app::answered([&] { return app::Room::get().speed(factor); });
}
/// The view into the patient, while it is open: "lookInside", "lookAway" of seldinger_control.
EMSCRIPTEN_KEEPALIVE const char* seldinger_inside() {
    return app::answered([] { return app::Room::get().inside(); });
}
EMSCRIPTEN_KEEPALIVE const void* seldinger_mesh(int which, int indices) {
    return app::Room::get().mesh(which, indices != 0);
}
/// The names of the files that were put into the cache.
EMSCRIPTEN_KEEPALIVE const char* seldinger_unpack(const char* file) {
    return app::answered([&] { return app::Room::unpack(file); });
}
/// {"exercise": "renal", "recording": FILE, "name": "renal-001.gw", "to": FILE}: writes the page of a
/// debriefing.
EMSCRIPTEN_KEEPALIVE const char* seldinger_debrief(const char* wanted) {
    return app::answered([&] { return app::Room::debrief(app::Json::parse(wanted)); });
}
/// {"files": [FILE…], "to": FILE, "title": "…"}: plays recordings, whose exercises' files must be there, and
/// keeps their figures; with "to" it writes a teacher's page, for which figures that are kept are enough.
EMSCRIPTEN_KEEPALIVE const char* seldinger_course(const char* wanted) {
    return app::answered([&] { return app::Room::course(app::Json::parse(wanted)); });
}
/// {"exercise": "renal", "learner": "", "patient": ""} of a recording.
EMSCRIPTEN_KEEPALIVE const char* seldinger_about(const char* recording) {
    return app::answered([&] { return app::Room::exercise_of(recording); });
}
/// Grey values of 0 the live image, 1 the reference image, 2 what seldinger_look() showed; null where there
/// is none.
EMSCRIPTEN_KEEPALIVE const std::uint8_t* seldinger_pixels(int which) {
    return app::Room::get().pixels(which);
}

/// Plays a recording without images: {"frames": n, "states": n, "differences": ["…"], "score": {…}}.
EMSCRIPTEN_KEEPALIVE const char* seldinger_replay(const char* scenario_file, const char* recording) {
    return app::answered([&] {
        const scenario::Scenario scenario = scenario::load_scenario(scenario_file, app::devices, {});
        const script::CommandScript script = script::load_commands(recording);
        exercise::Exercise exercise(scenario, exercise::Pictures::None, app::baked(), &script);
        const int last = script.last_frame(1);
        app::Json differences = app::Json::array();
        int compared = 0;
        for (int frame = 0; frame <= last; ++frame) {
            std::vector<script::Command> commands;
            for (const script::TimedCommand& timed : script.at(frame)) commands.push_back(timed.command);
            exercise.next_frame(commands);
            for (const script::StateCheck& check : script.checks) {
                if (check.frame != frame) continue;
                ++compared;
                const std::uint64_t hash = exercise.simulation().state_hash();
                if (hash != check.hash)
                    differences.push_back({{"frame", frame},
                                           {"found", io::hash_text(hash)},
                                           {"expected", io::hash_text(check.hash)}});
            }
        }
        app::Json made{{"frames", last + 1}, {"states", compared}, {"differences", differences}};
        made["score"] = app::Json::parse(exercise::to_json({"", "", exercise.finish(), {}, {}}));
        return made;
    });
}
}

int main() {
    return 0;
}
