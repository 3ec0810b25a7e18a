/// What the page's worker calls: the room of the engine, with answers as JSON.

#include "engine/debrief/page.h"

#include <algorithm>
#include <chrono>
#include <emscripten.h>
#include <exception>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

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
#include "engine/room/session.h"
#include "engine/room/words.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "physics/geometry/state.h"
#include "render/panel/readout.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;
using room::Action;
using room::Control;
using room::Phase;

constexpr const char *scenarios = "/assets/scenarios", *devices = "/assets/devices",
                     *scripts = "/assets/scripts", *attempts = "/attempts";
constexpr const char* program = "seldinger " SELDINGER_VERSION " (page)";
constexpr std::array<const char*, 6> phases = {"loading", "ready", "running", "paused", "ended", "failed"};
constexpr std::array<const char*, 4> notices = {"info", "success", "warning", "alarm"};

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

/// Numbers of a state that is none are null, as JSON has no others.
Json number(std::optional<double> value) {
    return render::is_known(value) ? Json(*value) : Json();
}

std::string with_unit(std::optional<double> value, int decimals, const char* unit) {
    return render::figure_text(value, decimals) + " " + unit;
}

Json rows(std::initializer_list<std::pair<std::string, std::string>> all) {
    Json made = Json::array();
    for (const auto& [name, value] : all) made.push_back({name, value});
    return made;
}

Json devices_of(const render::Readout& r) {
    Json made = Json::array();
    for (const render::Readout::Device& d : r.devices) {
        const std::optional<double> twist =
            d.hub_twist ? std::optional(*d.hub_twist * 180 / std::numbers::pi) : std::nullopt;
        made.push_back({{"name", d.name},
                        {"inserted", render::figure_text(d.inserted, 0) +
                                         (d.length ? " / " + render::figure_text(d.length, 0) : "") + " mm"},
                        {"fraction", d.inserted && d.length ? number(*d.inserted / *d.length) : Json()},
                        {"twist", render::figure_text(twist, 0) + "°"},
                        {"twistDegrees", number(twist)},
                        {"torque", with_unit(d.torque, 2, "N·mm")},
                        {"push", with_unit(d.push_force, 2, "N")},
                        {"grip", with_unit(d.grip, 0, "mm")},
                        {"bow", with_unit(d.bow, 1, "mm")}});
    }
    return made;
}

Json marks_of(const render::Readout& r) {
    const render::ImageMarks at =
        r.image.value_or(render::ImageMarks{r.mode, r.lao, r.cranial, {}, {}, {}, r.frame, {}});
    return {{"mode", at.mode},
            {"angles", render::primary_angle_text(at.lao) + "  " + render::secondary_angle_text(at.cranial)},
            {"mask", render::mask_shift_text(at.mask_x, at.mask_y)},
            {"frame", at.frame}};
}

Json readout_of(const render::Readout& r) {
    Json messages = Json::array();
    for (const render::Message& message : r.messages)
        messages.push_back(
            {{"text", message.text}, {"notice", notices[static_cast<std::size_t>(message.notice)]}});
    const render::ImageMarks* at = r.image ? &*r.image : nullptr;
    const render::ImageSides sides = render::image_sides(at ? at->lao : r.lao, at ? at->cranial : r.cranial);
    Json history = Json::array();
    for (const double force : r.force_history) history.push_back(number(force));
    std::string table = "--";
    if (r.table)
        table =
            fmt::format("{} / {} / {} cm", render::centimetre_text(r.table->longitudinal),
                        render::centimetre_text(r.table->lateral), render::centimetre_text(r.table->height));
    return {
        {"mode", r.mode},
        {"beamOn", r.beam_on},
        {"messages", messages},
        {"sides", {{"left", sides.left}, {"right", sides.right}, {"top", sides.top}}},
        {"groups",
         {{{"title", "C-arm"},
           {"rows", rows({{render::primary_angle_text(r.lao), render::secondary_angle_text(r.cranial)},
                          {"SID", render::centimetre_text(r.sid) + " cm"},
                          {"SOD", render::centimetre_text(r.sod) + " cm"},
                          {"Field", render::centimetre_text(r.field_of_view) + " cm"},
                          {"Table", table}})}},
          {{"title", "X-ray"},
           {"rows",
            rows({{"Tube", with_unit(r.tube_voltage, 0, "kV") + ", " + with_unit(r.tube_current, 0, "mA")},
                  {"Pulse",
                   with_unit(r.pulse_width, 1, "ms") + ", " + render::rate_text(r.pulse_rate) + " p/s"},
                  {"At detector", with_unit(r.detector_dose, 0, "nGy/pulse")}})}},
          {{"title", "Dose"},
           {"rows", rows({{"K_a,r", render::dose_text(r.air_kerma) + " mGy"},
                          {"Rate", render::dose_text(r.air_kerma_rate) + " mGy/min"},
                          {"P_KA", render::dose_text(r.kerma_area) + " Gy·cm²"},
                          {"Fluoro time", render::clock_text(r.fluoro_time)}})}},
          {{"title", "Contrast"},
           {"rows",
            rows({{"Given", render::figure_text(r.contrast, 1) +
                                (r.contrast_limit ? " / " + render::figure_text(r.contrast_limit, 0) : "") +
                                " ml"},
                  {"Rate", r.injection_rate > 0 ? with_unit(r.injection_rate, 1, "ml/s") : "--"}})}}}},
        {"devices", devices_of(r)},
        {"held", r.held},
        {"leftHand", r.left_hand},
        {"helper", r.helper},
        {"force",
         {{"wall", number(r.largest_wall_force)},
          {"tip", number(r.tip_force)},
          {"limit", r.force_limit},
          {"history", history}}},
        {"injecting", r.injection_rate},
        {"breathHeld", number(r.breath_held)},
        {"tipToTarget", number(r.tip_to_target)},
        {"lao", number(r.lao)},
        {"cranial", number(r.cranial)},
        {"mmPerImage",
         r.field_of_view && r.sod && r.sid ? number(*r.field_of_view * *r.sod / *r.sid) : Json()},
        {"marks", marks_of(r)}};
}

Json guide_of(const room::Guide& guide, const room::KeyMap& keys) {
    Json steps = Json::array();
    for (std::size_t k = 0; k < guide.size(); ++k) {
        Json practices = Json::array();
        const auto& practise = guide.step(k).practise;
        for (std::size_t p = 0; p < practise.size(); ++p)
            practices.push_back({{"text", script::help_of(practise[p])},
                                 {"keys", room::inputs_of(practise[p], keys)},
                                 {"done", guide.is_done(k, p)}});
        steps.push_back(
            {{"title", script::task_names[static_cast<std::size_t>(script::task_of(practise[0]))]},
             {"text", guide.step(k).text},
             {"done", guide.is_done(k)},
             {"skipped", guide.is_skipped(k)},
             {"practices", practices}});
    }
    return {{"step", guide.shown()}, {"done", guide.done()}, {"over", guide.over()}, {"steps", steps}};
}

Json size_of(const std::shared_ptr<const render::GrayImage>& image) {
    return image ? Json{{"width", image->width}, {"height", image->height}} : Json();
}

Json grade_lines(const exercise::Grade& grade) {
    Json made = Json::array();
    for (const exercise::GradeLine& line : grade.lines)
        made.push_back({{"name", line.measure->name},
                        {"own", exercise::own_text(line)},
                        {"skilled", exercise::skilled_text(line)},
                        {"cost", line.cost}});
    if (grade.cost_of_injuries() > 0)
        made.push_back({{"name", "Injuries of the wall"},
                        {"own", std::to_string(grade.dissections + grade.perforations)},
                        {"skilled", ""},
                        {"cost", grade.cost_of_injuries()}});
    return made;
}

Json notes_of(const exercise::Grade& grade, const scenario::Benchmark& skilled) {
    Json notes = Json::array();
    if (std::ranges::any_of(grade.lines, [](const auto& line) { return line.unseen; }))
        notes.push_back(exercise::blind_advice);
    for (const exercise::GradeLine& line : grade.lines)
        if (line.cost >= 2 && !line.unseen && std::string_view(line.measure->id) != "errors")
            notes.push_back(fmt::format("{}: {}", line.measure->name, line.measure->advice));
    notes.push_back(fmt::format("Skilled: {} attempts by {}.", skilled.attempts, skilled.by));
    return notes;
}

Json events_of(const room::View& view) {
    Json events = Json::array();
    for (const exercise::HandlingErrorMark& mark : view.score.handling_errors)
        events.push_back({{"time", render::clock_text(mark.start)},
                          {"frame", mark.first},
                          {"what", room::error_text(mark)},
                          {"advice", exercise::handling_error_advice[static_cast<std::size_t>(mark.kind)]},
                          {"kind", "error"}});
    for (const exercise::WrongBranch& branch : view.score.wrong_branches)
        events.push_back(
            {{"time", ""}, {"what", room::wrong_branch_text(branch)}, {"advice", ""}, {"kind", "branch"}});
    return events;
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
            exercises.push_back({{"name", s.name},
                                 {"title", s.title},
                                 {"level", s.lesson.level},
                                 {"summary", s.lesson.indication},
                                 {"picture", "pictures/" + s.name + ".png"},
                                 {"devices", s.devices.size()},
                                 {"guided", s.lesson.guided()},
                                 {"solution", std::filesystem::exists(solution(s.name), ignored)},
                                 {"benchmark", s.lesson.benchmark.given()},
                                 {"patients", Json::array()}});
        }
        // In the order of the course; those outside it last.
        std::stable_sort(exercises.begin(), exercises.end(), [](const Json& a, const Json& b) {
            const auto level = [](const Json& e) { return e["level"] == 0 ? 99 : e["level"].get<int>(); };
            return level(a) < level(b);
        });
        return {{"version", SELDINGER_VERSION},
                {"pass", exercise::pass_mark},
                {"exercises", exercises},
                {"keys", keys()}};
    }

    Json open(const Json& wanted) {
        session_.reset();
        view_.reset();
        sent_ = -1, image_ = reference_ = -1;
        is_free_ = wanted.value("free", false);
        is_solution_ = wanted.value("solution", false);
        const std::string name = wanted.at("exercise");
        room::SessionOptions options;
        options.scenario = scenario::load_scenario(file_of(name), devices, {});
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
        for (const auto& [name, control] : words)
            if (name == word) session_->give(control);
        if (const auto action = action_of(word)) session_->did(*action);
        return Json::object();
    }

    Json briefing() const {
        const scenario::Scenario& s = open_session().options().scenario;
        Json lines = Json::array();
        for (const auto& [name, value] : room::briefing(s)) lines.push_back({name, value});
        return {{"exercise", s.name},
                {"title", s.title},
                {"indication", s.lesson.indication},
                {"briefing", s.lesson.briefing},
                {"lines", lines},
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
        if (grade && !shows_script) notes = notes_of(*grade, s.lesson.benchmark);
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
                {"subtitle", s.title},
                {"lines", grade ? grade_lines(*grade) : Json::array()},
                {"notes", notes},
                {"events", is_solution_ ? captions()
                           : is_free_   ? Json::array()
                                        : events_of(view)},
                {"points", grade ? Json(grade->points) : Json()},
                {"passed", passed},
                {"reached", score.completed},
                {"seconds", number(score.completed_after)},
                {"formula", exercise::grade_formula},
                {"file", view.recorded.string()}};
    }

    Json look(const Json& wanted) {
        if (!view_) throw io::InputError("no run has been taken");
        const int number = wanted.value("run", 0);
        for (const auto& run : view_->runs) {
            if (run->number != number || run->images.empty()) continue;
            room::Look look;
            const int last = static_cast<int>(run->images.size()) - 1;
            look.image = static_cast<std::size_t>(std::clamp(wanted.value("image", last), 0, last));
            look.mask = static_cast<std::size_t>(std::clamp(wanted.value("mask", 0), 0, last));
            look.shift_x = wanted.value("shiftX", 0.0), look.shift_y = wanted.value("shiftY", 0.0);
            look.window = wanted.value("window", 256.0), look.level = wanted.value("level", 128.0);
            looked_ = std::make_shared<const render::GrayImage>(room::look_at(*run, look));
            return {{"run", number},
                    {"image", look.image},
                    {"count", run->images.size()},
                    {"width", looked_->width},
                    {"height", looked_->height}};
        }
        throw io::InputError("expected the number of a run, found {}", number);
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
        auto story = debrief::tell(scenario::load_scenario(file_of(wanted.at("exercise")), devices, {}),
                                   script, options);
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
            return scenario::load_scenario(file_of(name), devices, {});
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
        return {{"exercise", script.origin->scenario}, {"learner", script.origin->learner}};
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
        Json runs = Json::array();
        for (const auto& run : view.runs)
            runs.push_back({{"number", run->number},
                            {"mode", script::title_of(run->mode)},
                            {"images", run->images.size()}});
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
                     {"runs", runs}};
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
};

}  // namespace
}  // namespace app

extern "C" {

/// What there is: exercises in the order of the course, keys.
EMSCRIPTEN_KEEPALIVE const char* seldinger_begin() {
    return app::answered([] { return app::Room::get().begin(); });
}
/// Opens an exercise: {"exercise": "renal", "free": false, "solution": false, "learner": "", "speed": 1,
/// "replay": FILE}.
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
/// "start", "pause", "resume", "takeBack", "finish", "skipStep", or an action that the page did by itself.
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
/// {"exercise": "renal", "learner": ""} of a recording.
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
