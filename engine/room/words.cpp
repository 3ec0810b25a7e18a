#include "engine/room/words.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/organs.h"

namespace room {
namespace {

std::string degrees(double radians) {
    return fmt::format("{:.0f}°", radians * 180 / std::numbers::pi);
}

std::string view_text(const render::CArm& arm) {
    return fmt::format("{} {}, {} {}, field {:.0f} mm", arm.lao < 0 ? "RAO" : "LAO",
                       degrees(std::abs(arm.lao)), arm.cranial < 0 ? "caudal" : "cranial",
                       degrees(std::abs(arm.cranial)), arm.detector_width);
}

}  // namespace

Lines briefing(const scenario::Scenario& s) {
    Lines lines;
    const std::string name = anatomy::clinical_name(s.target.name);
    const std::string target = name.empty()            ? "the target on the map"
                               : name == s.target.name ? name
                                                       : "the " + name;
    lines.emplace_back(
        "Task",
        fmt::format("Bring the tip of the {} to {} (within {:g} mm) and hold it there for {:g} s.{}",
                    script::name_of(s.target.device), target, s.target.radius, s.target.hold,
                    s.target.residual ? fmt::format(" Open the narrow place to {:g} % of the vessel or more, "
                                                    "and empty the balloon.",
                                                    100 - *s.target.residual)
                                      : ""));
    lines.emplace_back("Access", anatomy::clinical_end(s.entry.end));
    for (const scenario::PlacedDevice& placed : s.devices)
        lines.emplace_back("Device", fmt::format("{}, {}: {:.0f} mm inside", placed.name(),
                                                 placed.device.title, placed.inserted));
    lines.emplace_back("View", view_text(s.c_arm));
    lines.emplace_back("Contrast", fmt::format("{:.0f} ml at most", s.blood.limit));
    lines.emplace_back("Time", s.time_limit ? fmt::format("{:.0f} s", *s.time_limit) : "no limit");
    if (s.beam_limit) lines.emplace_back("Beam", fmt::format("{:.0f} s", *s.beam_limit));
    for (const scenario::SuggestedView& view : s.lesson.views) {
        render::CArm arm = s.c_arm;
        arm.lao = view.lao;
        arm.cranial = view.cranial;
        lines.emplace_back("Look", fmt::format("{}: {}", view_text(arm), view.shows));
    }
    return lines;
}

std::string judgement(const scenario::Scenario& s) {
    if (s.lesson.guided())
        return fmt::format(
            "A guided lesson of {} steps: nothing is judged, and it is passed when all of them were done and "
            "the "
            "target is reached.",
            s.lesson.steps.size());
    const scenario::Benchmark& skilled = s.lesson.benchmark;
    if (!skilled.given())
        return "There is no benchmark yet, and so no points: 'seldinger benchmark' makes one of recordings.";
    std::string words = "Against skilled attempts: ";
    for (const exercise::GradeLine& line : exercise::grade({}, skilled).lines)
        if (line.mean && *line.mean > 0 && *line.measure->unit)
            words += fmt::format("{}{} {}", words.ends_with(": ") ? "" : ", ", line.measure->name,
                                 exercise::skilled_text(line));
    if (skilled.angiograms.least() >= 1) words += "; all of them took an angiogram";
    if (!s.patient.empty()) words += ". These were at the first patient";
    return words + fmt::format(". {:.0f} points pass.", exercise::pass_mark);
}

std::string keys_line(const KeyMap& keys, const scenario::Scenario& s) {
    const auto first = [&](Action action) { return keys.first(action); };
    return fmt::format(
        "Keys: {} {} push and pull, {} {} turn, {} fluoroscopy, {} {} run, {} roadmap, {} image to the "
        "reference "
        "screen{}, {} all keys",
        first(Action::Advance), first(Action::Withdraw), first(Action::RotateLeft),
        first(Action::RotateRight), first(Action::Fluoroscopy), first(Action::Acquisition),
        script::title_of(s.imaging.acquisition), first(Action::Roadmap), first(Action::Reference),
        s.devices.size() > 1 ? fmt::format(", left hand {} {} and {} {}", first(Action::LeftAdvance),
                                           first(Action::LeftWithdraw), first(Action::LeftRotateLeft),
                                           first(Action::LeftRotateRight))
                             : "",
        first(Action::Help));
}

std::string outcome(const View& view, const std::optional<exercise::Grade>& grade, bool free_practice) {
    const exercise::Score& score = view.score;
    if (free_practice) return "Free practice has ended";
    if (is_lesson_passed(view)) return "Lesson done: passed";
    if (!score.completed)
        return view.time_is_up ? "The time is over: target not reached" : "Ended: target not reached";
    return grade ? fmt::format("Target reached: {:.0f} points{}", grade->points,
                               grade->points >= exercise::pass_mark ? ", passed" : "")
                 : std::string("Target reached");
}

bool is_lesson_passed(const View& view) {
    return view.guide && view.guide->passed() && view.score.completed;
}

std::string without_benchmark(const exercise::Score& score) {
    return fmt::format(
        "{}{:.1f} s of beam, {:.0f} ml of contrast, {:.0f} mm of travel. This exercise has no benchmark yet, "
        "and so "
        "no points.",
        score.completed_after ? fmt::format("{:.1f} s to the target, ", *score.completed_after)
                              : std::string(),
        score.beam_on_time, score.contrast, score.wire_travel);
}

std::string error_text(const exercise::HandlingErrorMark& mark) {
    return fmt::format("{}: {}, {}", exercise::handling_error_texts[static_cast<std::size_t>(mark.kind)],
                       exercise::amount_text(mark), exercise::place_text(mark));
}

std::string wrong_branch_text(const exercise::WrongBranch& branch) {
    return fmt::format("The tip was in the {} {} for {:.1f} s; it does not lead to the target.",
                       anatomy::clinical_name(branch.name),
                       branch.entries == 1 ? "once" : fmt::format("{} times", branch.entries),
                       branch.seconds);
}

std::string teacher_text(const exercise::Score& score) {
    if (score.teacher.empty()) return "";
    return fmt::format("{}: {}.", exercise::heading_of(score.teacher), exercise::text_of(score.teacher));
}

}  // namespace room
