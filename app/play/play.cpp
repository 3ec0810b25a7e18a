#include "app/play/play.h"

#include <algorithm>
#include <fmt/format.h>
#include <fstream>
#include <imgui.h>
#include <utility>

#include "app/play/theme.h"
#include "engine/io/error.h"
#include "engine/io/files.h"

namespace app {
namespace {

using room::Clock;
using room::Phase;

constexpr double fastest = 1.0 / 60;  // between two drawings [s]
constexpr double idle = 0.25;         // between checks of the clock while nothing happens [s]

double seconds(Clock::duration d) {
    return std::chrono::duration<double>(d).count();
}

}  // namespace

Play::Play(Window& window, PlayOptions options)
    : window_(window),
      options_(std::move(options)),
      results_(std::filesystem::path()),
      image_(window.gl()),
      reference_(window.gl()),
      review_(window.gl()),
      teacher_(options_.teacher_width, options_.teacher_height),
      opened_(Clock::now()),
      drawn_at_(Clock::now()) {
    load_settings();
    set_learner(options_.learner.value_or(""));
    options_.keys.labels = Window::key_labels();
    thumbnails_.resize(options_.exercises.size());
    if (options_.teacher) open_teacher();
    if (!options_.replays.empty())
        show_replay(0);
    else if (options_.start)
        open(*options_.start, options_.free_practice, options_.patient);
    else if (options_.learner)
        screen_ = Screen::Chooser;
}

Play::~Play() {
    teacher_.close();
    window_.activate();
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
    list_results();
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
        io::make_folder(options_.settings.parent_path());
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
    teacher_.attend(nullptr);
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
    session.recorded = options_.recorded;
    session.origin = options_.origin;
    session.wake = Window::wake;
    session_ = std::make_unique<room::Session>(std::move(session));
    view_ = session_->view();
    teacher_.attend(session_.get());
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
    teacher_.attend(nullptr);
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
        const double wait = busy ? std::max(0.0, fastest - since) : idle;
        // While frames come they say when it is time for the teacher's window.
        window_.wait(running() ? wait : std::min(wait, teacher_.due_in().value_or(idle)));
        const Events events = window_.take_events();
        if (events.any) {
            redraw_ = 3;
            options_.keys.labels = Window::key_labels();  // the layout may have been switched
        }
        pass_on(events);
        watch_session();
        teacher_.hear(lesson(), window_);
        if (view_ && view_->serial != drawn_serial_) redraw_ = std::max(redraw_, 1);
        if (countdown_ || (review_open_ && review_.moves())) redraw_ = std::max(redraw_, 1);
        const bool drawn = draw_if_due(events);
        // The teacher's comes when the trainee's next frame is farthest away.
        if (const auto ms = teacher_.draw_if_due(lesson(), window_, drawn || !running()))
            measure_.teacher(*ms);
    }
    leave();
    return differed_;
}

/// Returns whether the window was drawn.
bool Play::draw_if_due(const Events& events) {
    if (!window_.can_be_seen()) {
        redraw_ = 3;
        return true;
    }
    if (redraw_ == 0) return false;
    const auto start = Clock::now();
    if (seconds(start - drawn_at_) < 0.9 * fastest && !events.any) return false;
    window_.begin_frame(window_.fitting_unit());
    draw(static_cast<float>(seconds(start - drawn_at_)));
    window_.end_frame();
    --redraw_;
    drawn_at_ = start;
    measure(start);
    return true;
}

void Play::measure(Clock::time_point start) {
    if (!view_) return;
    const auto end = Clock::now();
    if (screen_ == Screen::Room) {
        measure_.interface(seconds(end - start) * 1000);
        if (running() && view_->serial != drawn_serial_) measure_.shown(seconds(end - view_->made) * 1000);
    }
    drawn_serial_ = view_->serial;
    if (!view_->image || drawn_image_ == view_->image_serial) return;
    drawn_image_ = view_->image_serial;
    measure_.first_image(seconds(end - opened_));
    if (!view_->asked || view_->asked == measured_) return;
    measured_ = view_->asked;
    measure_.latency(seconds(end - *view_->asked) * 1000);
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
    list_results();
}

render::Canvas Play::canvas(render::Point origin) {
    return render::Canvas(*ImGui::GetBackgroundDrawList(), window_.faces(), window_.unit(), origin,
                          [this](auto&&... drawn) { point_at(drawn...); });
}

/// Notes the word of the glossary that the mouse is on, in a line as it is drawn.
void Play::point_at(const render::Canvas& sheet, std::string_view line, render::Face face, render::Ink,
                    render::Point place) {
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const float unit = window_.unit();
    const auto x = [&](std::size_t byte) {
        return place.x + sheet.text_width(line.substr(0, byte), face) * unit;
    };
    if (mouse.y < place.y || mouse.y >= place.y + sheet.text_height(face) * unit || mouse.x < place.x ||
        mouse.x >= x(line.size()))
        return;
    for (const GlossaryWord& word : glossary_words(line))
        if (x(word.begin) <= mouse.x && mouse.x < x(word.end)) pointed_at_ = word;
}

/// What the word under the mouse means, once the mouse has been still for half a second.
void Play::draw_meaning() {
    const ImGuiIO& io = ImGui::GetIO();
    const bool still = io.MouseDelta.x == 0 && io.MouseDelta.y == 0 && !ImGui::IsAnyMouseDown();
    if (!still || !pointed_at_) still_since_ = Clock::now();
    if (!pointed_at_) return;
    // Nothing else may happen in the meantime, and Dear ImGui shows a tooltip from its second frame on.
    const double still_for = seconds(Clock::now() - still_since_);
    if (still_for < 0.8) redraw_ = std::max(redraw_, 2);
    if (still_for < 0.5) return;
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(u(320));
    text(render::palette::bright, std::string(pointed_at_->name));
    text(render::palette::value, std::string(pointed_at_->meaning));
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
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
            pointed_at_.reset();
            draw_room();
            if (!menu_ && !help_ && !asking_ && !review_open_) draw_meaning();
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
