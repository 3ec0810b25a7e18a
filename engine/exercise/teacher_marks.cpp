#include "engine/exercise/teacher_marks.h"

#include <algorithm>
#include <fmt/format.h>

#include "render/panel/readout.h"

namespace exercise {

using Thing = script::TeacherAct::Thing;

std::string id_of(const script::TeacherAct& act) {
    return act.thing == Thing::Paused
               ? "paused"
               : std::string(script::teacher_things[static_cast<std::size_t>(act.thing)]);
}

bool helps(const script::TeacherAct& act) {
    return act.on && (act.thing == Thing::Target || act.thing == Thing::Way);
}

std::string text_of(const script::TeacherAct& act) {
    if (act.thing == Thing::Paused) return "paused";
    if (act.thing == Thing::Window) return act.on ? "window opened" : "window closed";
    return fmt::format("{} {}", id_of(act), act.on ? "shown" : "hidden");
}

std::string moment_text(double seconds) {
    return render::clock_text(seconds);
}

std::string text_of(std::span<const TeacherMark> marks) {
    std::string text;
    for (const TeacherMark& mark : marks)
        text +=
            fmt::format("{}{} at {}", text.empty() ? "" : ", ", text_of(mark.act), moment_text(mark.seconds));
    return text;
}

std::string heading_of(std::span<const TeacherMark> marks) {
    return std::ranges::any_of(marks, [](const TeacherMark& mark) { return helps(mark.act); })
               ? "helped by the teacher"
               : "by the teacher";
}

}  // namespace exercise
