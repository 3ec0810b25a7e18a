#pragma once
/// What a teacher did to the trainee's screen and clock during an attempt, as facts beside its figures.

#include <span>
#include <string>

#include "engine/script/command.h"
#include "physics/geometry/state.h"

namespace exercise {

struct TeacherMark {
    script::TeacherAct act;
    int frame = 0;       // of the run
    double seconds = 0;  // of the attempt, at the frame's end

    void state(geometry::StateStream& s) { s(act.thing, act.on, frame, seconds); }
};

/// As in score.json: one of script::teacher_things, or "paused".
std::string id_of(const script::TeacherAct&);
/// Whether the act shows what the trainee has to find.
bool helps(const script::TeacherAct&);
/// "target shown", "hints hidden", "paused".
std::string text_of(const script::TeacherAct&);
/// "0:31".
std::string moment_text(double seconds);
/// "target shown at 0:31, target hidden at 0:45"; empty for none.
std::string text_of(std::span<const TeacherMark>);
/// What stands before that: "helped by the teacher" where one of them helps, else "by the teacher".
std::string heading_of(std::span<const TeacherMark>);

}  // namespace exercise
