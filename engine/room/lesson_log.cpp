#include "engine/room/lesson_log.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/anatomy/organs.h"
#include "engine/exercise/handling.h"
#include "render/panel/readout.h"

namespace room {
namespace {

using Kind = LessonEvent::Kind;

/// Air kerma at which a line says so [mGy].
constexpr double dose_marks[] = {10, 20, 50, 100, 200, 500, 1000, 2000, 3000, 5000};

std::string sentence_of(const exercise::HandlingErrorMark& mark) {
    return fmt::format("{}: {}", exercise::handling_error_texts[static_cast<std::size_t>(mark.kind)],
                       exercise::amount_text(mark));
}

bool is_injury(const exercise::HandlingErrorMark& mark) {
    return mark.kind == exercise::HandlingError::Dissection ||
           mark.kind == exercise::HandlingError::Perforation;
}

std::string site_name(const script::Inject& inject) {
    if (!inject.branch.empty()) return "into the " + anatomy::clinical_name(inject.branch);
    return fmt::format("through the {}", inject.introducer ? "introducer" : script::name_of(inject.through));
}

}  // namespace

void LessonLog::insert(LessonEvent event) {
    const auto later = std::ranges::upper_bound(events_, event.frame, {}, &LessonEvent::frame);
    events_.insert(later, std::move(event));
    ++version_;
}

void LessonLog::add(Kind kind, const exercise::Frame& frame, std::string what, std::string where) {
    insert({kind, frame.time.index, frame.time.seconds, std::move(what), std::move(where)});
}

void LessonLog::begin() {
    peaks_ = {};
    amounts_.clear();
    entries_.clear();
    given_ = 0;
    injects_ = reached_ = false;
    runs_ = doses_ = 0;
    set_ = 0;
    relieved_.clear();
}

void LessonLog::observe(const exercise::Frame& frame, const exercise::Score& score) {
    if (frame.motion.reset) {
        begin();
        add(Kind::Attempt, frame, "A new attempt begins");
    }
    ends_.resize(static_cast<std::size_t>(frame.time.index) + 1, frame.time.seconds);
    ends_.back() = frame.time.seconds;
    follow_commands(frame);
    follow_complications(frame, score);
    follow_errors(score);
    follow_branches(frame, score);
    follow_contrast(frame);
    follow_beam(frame, score);
    follow_forces(frame);
    if (score.completed && !std::exchange(reached_, true)) add(Kind::Target, frame, "Target reached");
}

/// An error grows while it lasts: its line is kept up to date.
void LessonLog::follow_errors(const exercise::Score& score) {
    for (std::size_t k = 0; k < score.handling_errors.size(); ++k) {
        const exercise::HandlingErrorMark& mark = score.handling_errors[k];
        const Kind kind = is_injury(mark) ? Kind::Injury : Kind::Error;
        if (k == amounts_.size()) {
            amounts_.push_back(mark.amount);
            insert({kind, mark.first, mark.start, sentence_of(mark), exercise::place_text(mark)});
        } else if (amounts_[k] != mark.amount) {
            const std::string_view text = exercise::handling_error_texts[static_cast<std::size_t>(mark.kind)];
            for (LessonEvent& event : events_)
                if (event.kind == kind && event.frame == mark.first && event.what.starts_with(text))
                    event.what = sentence_of(mark);
            amounts_[k] = mark.amount;
            ++version_;
        }
    }
}

void LessonLog::follow_branches(const exercise::Frame& frame, const exercise::Score& score) {
    entries_.resize(score.wrong_branches.size());
    for (std::size_t k = 0; k < entries_.size(); ++k) {
        const exercise::WrongBranch& branch = score.wrong_branches[k];
        if (std::exchange(entries_[k], branch.entries) < branch.entries)
            add(Kind::Branch, frame, "The tip went into a branch that does not lead to the target",
                anatomy::clinical_name(branch.name));
    }
}

void LessonLog::follow_contrast(const exercise::Frame& frame) {
    const blood::ContrastFlow& contrast = frame.simulation.contrast();
    const bool injects = contrast.injection_rate() > 0;
    if (injects && !injects_) {
        std::string where;
        for (const script::Command& command : frame.commands)
            if (const auto* inject = std::get_if<script::Inject>(&command)) where = site_name(*inject);
        add(Kind::Contrast, frame, "Contrast is injected", std::move(where));
    }
    if (!injects && injects_) {
        const auto begun = std::find_if(events_.rbegin(), events_.rend(), [](const LessonEvent& event) {
            return event.kind == Kind::Contrast;
        });
        if (begun != events_.rend()) {
            begun->what = fmt::format("Contrast: {:.1f} ml", contrast.injected() - given_);
            ++version_;
        }
    }
    if (!injects) given_ = contrast.injected();
    injects_ = injects;
}

void LessonLog::follow_beam(const exercise::Frame& frame, const exercise::Score& score) {
    const render::CArm arm = frame.simulation.console().arm();
    if (std::exchange(runs_, score.runs) < score.runs)
        add(Kind::Run, frame, fmt::format("DSA run {}", score.runs),
            render::primary_angle_text(arm.lao) + ", " + render::secondary_angle_text(arm.cranial));
    int passed = doses_;
    while (passed < static_cast<int>(std::size(dose_marks)) &&
           score.air_kerma.value_or(0) >= dose_marks[passed])
        ++passed;
    if (std::exchange(doses_, passed) < passed)
        add(Kind::Dose, frame, fmt::format("Dose: {:g} mGy of air kerma", dose_marks[passed - 1]));
}

void LessonLog::follow_commands(const exercise::Frame& frame) {
    for (const script::Command& command : frame.commands) {
        const auto* act = std::get_if<script::TeacherAct>(&command);
        if (act && act->thing != script::TeacherAct::Thing::Window)
            add(Kind::Teacher, frame, "The teacher: " + exercise::text_of(*act));
    }
    if (frame.motion.breath == scenario::Breathing::Event::Gasped)
        add(Kind::Patient, frame, "The patient gasps: the breath was held too long");
}

/// What a teacher sets and relieves, and devices that hold it off.
void LessonLog::follow_complications(const exercise::Frame& frame, const exercise::Score& score) {
    const auto& all = score.set_by_teacher;
    relieved_.resize(all.size(), false);
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (k >= set_) add(Kind::Patient, frame, "Set: " + all[k].text);
        if (all[k].relieved && !relieved_[k]) add(Kind::Patient, frame, "Relieved: " + all[k].text);
        relieved_[k] = all[k].relieved.has_value();
    }
    set_ = all.size();
}

void LessonLog::follow_forces(const exercise::Frame& frame) {
    const exercise::Simulation& simulation = frame.simulation;
    for (const scenario::PlacedDevice& placed : simulation.devices())
        peaks_.push = std::max(peaks_.push, std::abs(simulation.hand(placed.role).load.push));
    const auto contacts = simulation.contacts();
    if (contacts.empty()) return;
    peaks_.tip = std::max(peaks_.tip, contacts.back().force());
    for (const physics::WallContact& contact : contacts.subspan(1))
        peaks_.wall = std::max(peaks_.wall, contact.force());
}

void LessonLog::comment(const script::Comment& comment) {
    const auto at = static_cast<std::size_t>(comment.frame);
    insert({Kind::Comment, comment.frame, at < ends_.size() ? ends_[at] : 0, comment.text, {}});
}

void LessonLog::take_back(int frame, const exercise::Score& score) {
    std::erase_if(events_, [frame](const LessonEvent& event) { return event.frame > frame; });
    ends_.resize(std::min(ends_.size(), static_cast<std::size_t>(frame + 1)));
    amounts_.clear();
    for (const exercise::HandlingErrorMark& mark : score.handling_errors) amounts_.push_back(mark.amount);
    entries_.clear();
    for (const exercise::WrongBranch& branch : score.wrong_branches) entries_.push_back(branch.entries);
    runs_ = score.runs;
    set_ = score.set_by_teacher.size();
    relieved_.clear();
    for (const exercise::SetByTeacher& one : score.set_by_teacher)
        relieved_.push_back(one.relieved.has_value());
    reached_ = score.completed;
    injects_ = false;
    given_ = score.contrast;
    ++version_;
}

}  // namespace room
