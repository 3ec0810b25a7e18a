#include "app/play/play.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <imgui.h>
#include <utility>

#include "engine/io/error.h"
#include "engine/io/files.h"

namespace app {
namespace {

using room::Action;
using room::Clock;
using room::Phase;

constexpr double fastest = 1.0 / 60;  // between two drawings [s]
constexpr double idle = 0.25;         // between checks of the clock while nothing happens [s]

double seconds(Clock::duration d) {
    return std::chrono::duration<double>(d).count();
}

double share(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    const std::size_t at = std::min(values.size() - 1, static_cast<std::size_t>(part * values.size()));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[at];
}

}  // namespace

void Measure::write(const std::filesystem::path& path, int frames, int lost) const {
    const auto part = [](const std::vector<double>& values) {
        return fmt::format("{{\"count\": {}, \"median\": {:.2f}, \"p99\": {:.2f}, \"max\": {:.2f}}}",
                           values.size(), share(values, 0.5), share(values, 0.99), share(values, 1));
    };
    io::write_whole(path,
                    fmt::format("{{\n  \"start_to_first_image_s\": {:.2f},\n  \"key_to_image_ms\": {},\n  "
                                "\"interface_ms\": {},\n  \"frames\": {},\n  \"late_frames\": {}\n}}\n",
                                first_.value_or(0), part(latency_), part(interface_), frames, lost));
}

Play::Play(Window& window, PlayOptions options)
    : window_(window),
      options_(std::move(options)),
      results_(std::filesystem::path()),
      image_(window.gl()),
      reference_(window.gl()),
      review_(window.gl()),
      instructor_(window.gl()),
      opened_(Clock::now()),
      drawn_at_(Clock::now()) {
    load_settings();
    set_learner(options_.learner.value_or(""));
    options_.keys.labels = Window::key_labels();
    thumbnails_.resize(options_.exercises.size());
    if (!options_.replays.empty())
        show_replay(0);
    else if (options_.start)
        open(*options_.start, options_.free_practice, options_.patient);
    else if (options_.learner)
        screen_ = Screen::Chooser;
}

Play::~Play() {
    debriefing_stops_ = true;
    if (debriefing_.valid()) debriefing_.wait();
}

void Play::load_settings() {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(options_.settings, ignored)) return;
    std::ifstream file(options_.settings);
    std::string word;
    while (file >> word) {
        if (word == "no-hints") hints_ = false;
        if (word == "open-all") options_.open_all = true;
    }
}

/// From here on attempts and results are this learner's.
void Play::set_learner(const std::string& name) {
    learner_ = name;
    options_.origin.learner = name;
    results_ = room::Results(options_.learners.results(name));
    attempts_problem_.clear();
    attempts_ = options_.record.value_or(options_.learners.attempts(name));
    try {
        if (!attempts_.kept())
            throw io::InputError(
                "expected HOME or XDG_DATA_HOME to name a folder, found neither; --record names one");
        attempts_.require_writable();
    } catch (const io::InputError& error) {
        attempts_problem_ = error.what();
        attempts_ = {};
    }
}

bool Play::has_passed(std::size_t exercise) const {
    const room::BestResult* best = results_.find(options_.exercises[exercise].scenario.name);
    return best && best->passed > 0;
}

bool Play::is_open(std::size_t exercise) const {
    const int level = options_.exercises[exercise].scenario.lesson.level;
    if (options_.open_all || level <= 1) return true;
    int before = 0, passed = 0;
    for (std::size_t k = 0; k < options_.exercises.size(); ++k) {
        if (options_.exercises[k].scenario.lesson.level != level - 1) continue;
        ++before;
        passed += has_passed(k);
    }
    return 3 * passed >= 2 * before;
}

std::optional<std::size_t> Play::next_exercise(std::optional<std::size_t> after) const {
    const std::size_t count = options_.exercises.size(), from = after ? *after + 1 : 0;
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t next = (from + k) % count;
        if (options_.exercises[next].scenario.lesson.level > 0 && is_open(next) && !has_passed(next) &&
            next != after)
            return next;
    }
    return {};
}

void Play::save_settings() const {
    if (options_.settings.empty()) return;
    try {
        std::error_code ignored;
        std::filesystem::create_directories(options_.settings.parent_path(), ignored);
        io::write_whole(options_.settings, std::string(hints_ ? "hints\n" : "no-hints\n") +
                                               (options_.open_all ? "open-all\n" : ""));
    } catch (const io::InputError&) {
        // Failing to save the window's state is no reason to disturb the user.
    }
}

void Play::show_replay(std::size_t number) {
    if (view_) differed_ = differed_ || !view_->differences.empty();
    replay_ = number;
    watched_.reset();
    is_replay_ = true;
    shows_solution_ = false;
    const Replay& shown = options_.replays[number];
    open(shown.exercise, false, shown.recording.origin ? shown.recording.origin->patient : "");
}

void Play::open(std::size_t exercise, bool free_practice, const std::string& patient) {
    session_.reset();
    patient_ = patient;
    chosen_ = exercise;
    free_practice_ = free_practice;
    grade_.reset();
    settled_ = false;
    results_problem_.clear();
    debriefing_text_.clear();
    review_.reset();
    run_pictures_.clear();
    instructor_.reset();
    review_open_ = menu_ = false;
    countdown_.reset();
    asking_.reset();
    used_left_ = false;
    hint_ = 0;
    hints_shown_ = 0;
    start_focused_ = false;

    const Exercise& chosen = options_.exercises[exercise];
    room::SessionOptions session;
    session.scenario = patient_.empty() ? chosen.scenario : options_.of_patient(chosen, patient_);
    session.cache.folder = options_.cache;
    session.keys = options_.keys;
    session.free_practice = free_practice;
    if (is_replay_) session.script = (watched_ ? *watched_ : options_.replays[replay_]).recording;
    if (shows_solution_) session.script = chosen.solution;
    if (!session.script) session.record = attempts_;
    session.origin = options_.origin;
    session.wake = Window::wake;
    session_ = std::make_unique<room::Session>(std::move(session));
    view_ = session_->view();
    drawn_serial_ = drawn_image_ = -1;
    screen_ = is_replay_ || shows_solution_ ? Screen::Room : Screen::Briefing;
}

/// The learner's own attempt once more, from its recording.
void Play::watch_attempt() {
    try {
        watched_ = Replay{*chosen_, script::load_commands(view_->recorded)};
    } catch (const io::InputError& error) {
        results_problem_ = error.what();
        return;
    }
    is_replay_ = true;
    shows_solution_ = false;
    open(*chosen_, false, std::string(patient_));
}

/// The page is made on a thread of its own: it plays the recording.
void Play::ask_debriefing() {
    if (debriefing_.valid() || !options_.make_debriefing) return;
    debriefing_text_ = "The debriefing is being made ...";
    debriefing_ =
        std::async(std::launch::async, [make = options_.make_debriefing, recording = view_->recorded,
                                        scenario = session_->options().scenario, &stop = debriefing_stops_] {
            std::filesystem::path page = make(recording, scenario, stop);
            Window::wake();
            return page;
        });
}

void Play::watch_debriefing() {
    if (!debriefing_.valid() || debriefing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return;
    redraw_ = 3;
    try {
        const std::filesystem::path page = debriefing_.get();
        debriefing_text_ = fmt::format("Debriefing: {}", page.string());
        options_.show_page(page);
    } catch (const std::exception& error) {
        debriefing_text_ += fmt::format("{}{}", debriefing_text_.empty() ? "" : "\n", error.what());
    }
}

void Play::play_solution() {
    shows_solution_ = true;
    is_replay_ = false;
    open(*chosen_, false);
}

void Play::leave() {
    if (session_ && view_ && !options_.measure.empty())
        measure_.write(options_.measure, view_->frames, view_->lost_frames);
    if (view_) differed_ = differed_ || !view_->differences.empty();
    session_.reset();
    view_.reset();
    shows_solution_ = is_replay_ = false;
    watched_.reset();
    menu_ = false;
    asking_.reset();
    screen_ = Screen::Chooser;
}

bool Play::run() {
    while (!quits_ && !window_.wants_to_close() && !(options_.interrupted && options_.interrupted())) {
        const double since = seconds(Clock::now() - drawn_at_);
        const bool busy = redraw_ > 0 || countdown_ || (review_open_ && review_.moves());
        window_.wait(busy ? std::max(0.0, fastest - since) : idle);
        const Events events = window_.take_events();
        if (events.any) {
            redraw_ = 3;
            options_.keys.labels = Window::key_labels();  // the layout may have been switched
        }
        pass_on(events);
        watch_session();
        if (view_ && view_->serial != drawn_serial_) redraw_ = std::max(redraw_, 1);
        if (countdown_ || (review_open_ && review_.moves())) redraw_ = std::max(redraw_, 1);
        if (redraw_ == 0 || !window_.can_be_seen()) {
            if (!window_.can_be_seen()) redraw_ = 3;
            continue;
        }
        const auto start = Clock::now();
        if (seconds(start - drawn_at_) < 0.9 * fastest && !events.any) continue;
        window_.begin_frame(choose_unit());
        draw(static_cast<float>(seconds(start - drawn_at_)));
        window_.end_frame();
        --redraw_;
        const auto end = Clock::now();
        drawn_at_ = start;
        if (view_) {
            drawn_serial_ = view_->serial;
            if (screen_ == Screen::Room) measure_.interface(seconds(end - start) * 1000);
            if (view_->image && drawn_image_ != view_->image_serial) {
                drawn_image_ = view_->image_serial;
                measure_.first_image(seconds(end - opened_));
                if (view_->asked && view_->asked != measured_) {
                    measured_ = view_->asked;
                    measure_.latency(seconds(end - *view_->asked) * 1000);
                }
            }
        }
    }
    leave();
    return differed_;
}

void Play::obey(Action action) {
    switch (action) {
        case Action::Help:
            help_ = !help_;
            break;
        case Action::Menu:
            if (help_)
                help_ = false;
            else if (review_open_)
                review_open_ = false;
            else if (instructor_open_)
                instructor_open_ = false;
            else
                menu_ = !menu_;
            if (session_ && screen_ == Screen::Room)
                session_->give(menu_ ? room::Control::Pause : room::Control::Resume);
            break;
        case Action::Instructor:
            instructor_open_ = !instructor_open_;
            if (session_)
                session_->give(instructor_open_ ? room::Control::WatchSolver : room::Control::IgnoreSolver);
            break;
        case Action::Review:
            review_open_ = !review_open_;
            break;
        case Action::Pause:
            if (session_ && view_ && !countdown_) {
                if (view_->phase == Phase::Paused) session_->did(Action::Pause);
                session_->give(running() ? room::Control::Pause : room::Control::Resume);
            }
            break;
        case Action::Skip:
            if (session_) session_->give(room::Control::SkipStep);
            break;
        case Action::TakeBack:
            if (session_) session_->give(room::Control::TakeBack);
            break;
        case Action::Finish:
        case Action::BackToStart:
            ask(action);
            break;
        default:
            break;
    }
}

/// Asks before an attempt ends; of what a script plays nothing is lost.
void Play::ask(Action action) {
    if (!session_ || !view_ || countdown_ || (!running() && view_->phase != Phase::Paused)) return;
    if (session_->options().script) {
        if (action == Action::Finish) session_->give(room::Control::Finish);
        return;
    }
    asking_ = action;
    ran_ = running();
    session_->give(room::Control::Pause);
}

void Play::answer(bool yes) {
    const Action asked = *std::exchange(asking_, {});
    if (yes && asked == Action::Finish) return session_->give(room::Control::Finish);
    if (yes) {
        room::Input input;
        input.pressed.push_back(Action::BackToStart);
        session_->give(input);
    }
    if (yes || ran_) session_->give(room::Control::Resume);
}

void Play::hear_answer(const Events& events) {
    session_->give(room::Input());
    for (const room::Key key : events.pressed) {
        const std::string_view name = room::key_names()[static_cast<std::size_t>(key)];
        const bool yes = name == "Enter" || name == "KeypadEnter" || name == "GamepadA";
        if (yes || name == "Escape" || name == "GamepadB") return answer(yes);
    }
}

/// Handles keys of the window; hands and feet go to the session.
void Play::pass_on(const Events& events) {
    const room::KeyMap& map = options_.keys;
    if (asking_) return hear_answer(events);
    if (screen_ == Screen::Room && session_) {
        const bool hands_free = !menu_ && !review_open_ && !countdown_;
        room::Input input = hands_free ? input_of(events) : room::Input();
        std::optional<Clock::time_point> asked;
        for (const room::Key key : events.pressed) {
            for (int k = 0; k < room::actions; ++k) {
                const auto action = static_cast<Action>(k);
                if (std::find(map.keys[k].begin(), map.keys[k].end(), key) == map.keys[k].end()) continue;
                obey(action);
                if (asking_) return session_->give(room::Input());
                if (hands_free && room::moves_device(action)) asked = events.first_press;
            }
        }
        if (events.wheel != 0 && hands_free) asked = Clock::now();
        session_->give(input, asked);
        return;
    }
    if (ImGui::GetIO().WantTextInput) return;  // a name is being typed
    for (const room::Key key : events.pressed)
        for (const Action action : {Action::Help, Action::Menu}) {
            const auto& keys = map.keys[static_cast<int>(action)];
            if (std::find(keys.begin(), keys.end(), key) != keys.end()) obey(action);
        }
}

room::Input Play::input_of(const Events& events) {
    const room::KeyMap& map = options_.keys;
    room::Input input;
    for (int k = 0; k < room::actions; ++k) {
        for (const room::Key key : map.keys[k]) {
            const bool pressed =
                std::find(events.pressed.begin(), events.pressed.end(), key) != events.pressed.end();
            if (window_.holds(key) || pressed) input.held.set(static_cast<std::size_t>(k));
            // What begins a new attempt is asked first.
            if (pressed && static_cast<Action>(k) >= room::first_pressed &&
                static_cast<Action>(k) != Action::BackToStart)
                input.pressed.push_back(static_cast<Action>(k));
        }
    }
    for (const room::Key key : events.pressed)
        for (std::size_t k = 0; k < map.injections.size(); ++k)
            if (map.injections[k].key == key) input.injections.push_back(static_cast<int>(k));
    input.wheel = help_ ? 0 : events.wheel;  // there it scrolls
    used_left_ = used_left_ || input.holds(Action::LeftAdvance) || input.holds(Action::LeftWithdraw);
    input.drag_up = std::exchange(drag_up_, 0);
    input.drag_right = std::exchange(drag_right_, 0);
    input.arm_lao = std::exchange(arm_lao_, 0);
    input.arm_cranial = std::exchange(arm_cranial_, 0);
    input.table_left = std::exchange(table_left_, 0);
    input.table_head = std::exchange(table_head_, 0);
    const Window::Sticks sticks = window_.sticks();
    input.push = sticks.push;
    input.turn = sticks.turn;
    return input;
}

/// What was opened and is closed again was practised.
void Play::tell_guide() {
    const std::array<bool, 3> open = {review_open_, help_, menu_};
    constexpr std::array<Action, 3> actions = {Action::Review, Action::Help, Action::Menu};
    for (std::size_t k = 0; k < open.size(); ++k)
        if (were_open_[k] && !open[k] && session_ && screen_ == Screen::Room) session_->did(actions[k]);
    were_open_ = open;
}

void Play::watch_session() {
    watch_debriefing();
    tell_guide();
    std::string title = "Seldinger";
    if (session_) {
        view_ = session_->view();
        constexpr const char* phases[] = {"loading", "ready", "running", "paused", "ended", "failed"};
        title = fmt::format("Seldinger - {}{} - {}", session_->options().scenario.name,
                            patient_.empty() ? "" : ", patient " + patient_,
                            countdown_ ? "countdown"
                            : asking_  ? "asks"
                                       : phases[static_cast<int>(view_->phase)]);
        if (view_->guide)
            title += fmt::format(" - {} of {} steps", view_->guide->done(), view_->guide->size());
        if (view_->phase == Phase::Ready && screen_ == Screen::Room) {
            if (shows_solution_ || is_replay_) {
                session_->give(room::Control::Start);
            } else if (countdown_ && Clock::now() >= *countdown_) {
                countdown_.reset();
                session_->give(room::Control::Start);
            }
            if (instructor_open_) session_->give(room::Control::WatchSolver);
        }
        if (view_->phase == Phase::Ended && screen_ == Screen::Room) end_attempt();
    } else {
        title += screen_ == Screen::Learner ? " - learner" : " - choose";
    }
    if (title != title_) window_.set_title(title_ = title);
}

void Play::end_attempt() {
    screen_ = Screen::End;
    redraw_ = 3;
    settle();
}

void Play::settle() {
    if (session_->options().script || free_practice_ || settled_ || view_->tuned) return;
    settled_ = true;
    const scenario::Benchmark& skilled = session_->options().scenario.lesson.benchmark;
    exercise::Grade made;
    made.reached = view_->score.completed;
    if (skilled.given()) grade_ = made = exercise::grade(view_->score, skilled);
    const std::string& name = session_->options().scenario.name;
    try {
        if (view_->guide)
            results_.add_lesson(name, view_->guide->done(), static_cast<int>(view_->guide->size()),
                                view_->score);
        else
            results_.add(name, made, view_->score, patient_);
    } catch (const io::InputError& error) {
        results_problem_ = error.what();
    }
}

/// The largest unit at which the readouts fit the height, in steps, as each needs its own font.
float Play::choose_unit() const {
    const float height = static_cast<float>(window_.height()), width = static_cast<float>(window_.width());
    const float fits = std::min((height - 30) / 790.0f, width / 1050.0f);
    const float steps = 20;
    return std::clamp(std::floor(fits * steps) / steps, 0.6f, 4.0f);
}

render::Canvas Play::canvas(render::Point origin) const {
    return render::Canvas(*ImGui::GetBackgroundDrawList(), window_.faces(), window_.unit(), origin);
}

void Play::draw(float time) {
    ImGui::GetIO().ConfigFlags =
        screen_ == Screen::Room && !menu_ ? ImGuiConfigFlags_None : ImGuiConfigFlags_NavEnableKeyboard;
    switch (screen_) {
        case Screen::Learner:
            draw_learner();
            break;
        case Screen::Chooser:
            draw_chooser();
            break;
        case Screen::Briefing:
            draw_briefing();
            break;
        case Screen::Room:
            draw_room();
            break;
        case Screen::End:
            draw_end();
            break;
    }
    const render::Box whole{0, 0, static_cast<float>(window_.width()), static_cast<float>(window_.height())};
    if (review_open_ && view_ && (screen_ == Screen::Room || screen_ == Screen::End))
        review_open_ = review_.draw(view_->runs, whole, window_, time,
                                    session_->options().scenario.wire().device.outer_diameter);
    if (help_) draw_help();
    if (asking_ && screen_ == Screen::Room) draw_asking();
    if (menu_) draw_menu();
}

}  // namespace app
