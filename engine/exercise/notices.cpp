#include "engine/exercise/notices.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/exercise/imaging.h"
#include "engine/exercise/open_field.h"

namespace exercise {
namespace {

constexpr double kink =
    std::numbers::pi / 3;  // bend of one joint beyond which Eq. 1 no longer straightens it [rad]

std::string frames(int count) {
    return fmt::format("{} frame{}", count, count == 1 ? "" : "s");
}

/// What would have put the tip in the middle of the image: the table where it reaches so far.
std::string what_shows(const geometry::Vec3& table, const geometry::Vec3& tip) {
    if ((table.cwiseAbs() - script::table_reach).maxCoeff() <= 0)
        return fmt::format("'table {:.0f} {:.0f} {:.0f} mm'", table.x(), table.y(), table.z());
    return fmt::format("[c_arm] isocentre_mm = [{:.0f}, {:.0f}, {:.0f}]", tip.x(), tip.y(), tip.z());
}

}  // namespace

std::string mask_shift_sentence(const MaskShift& shift) {
    if (shift.outcome == MaskShift::Outcome::NoMask)
        return "The mask was not shifted: the image is no subtraction";
    if (shift.outcome == MaskShift::Outcome::NoMatch)
        return "The mask was not shifted: it has nothing in common with the image";
    if (shift.x == 0 && shift.y == 0)
        return shift.automatic ? "The mask fits best without a shift" : "The mask is where it was taken";
    return fmt::format("The mask was shifted by {:.2f} pixels to the {} and {:.2f} {}{}", std::abs(shift.x),
                       shift.x < 0 ? "left" : "right", std::abs(shift.y), shift.y < 0 ? "up" : "down",
                       shift.limited ? ": no further than a quarter of the image" : "");
}

void Notices::watch_tip(const Frame& frame) {
    const Simulation& simulation = frame.simulation;
    if (!simulation.console().beam_on()) return;
    const auto shows = [&](const geometry::Vec3& place) { return in_open_field(simulation, place); };
    const bool unseen = !shows(simulation.tip());
    if (unseen && !unseen_.now && unseen_.episodes++ == 0) {
        unseen_.first = frame.time.index;
        unseen_.remedy = what_shows(table_to_show(simulation, simulation.tip()), simulation.tip());
        const geometry::Polyline wire = simulation.path_of(script::DeviceRole::Wire);
        wire_was_out_ = !beam_was_on_ && std::none_of(wire.begin(), wire.end(), shows);
    }
    unseen_.frames += unseen;
    unseen_.now = unseen;
    beam_was_on_ = true;
}

void Notices::observe(const Frame& frame) {
    watch_tip(frame);
    const StepReport& report = frame.motion;
    stopped_withdrawals_ += report.withdrawal_stopped;
    past_ends_ += report.past_vessel_end;
    used_up_ += report.whole_wire_is_in;
    kinked_ += report.relax.largest_bend > kink;
    settling_ += report.settling;
    refused_ += report.refused && !report.buckled;
    buckled_ += report.buckled;
    too_thick_ += report.too_thick;
    if (!report.denied.empty() && std::find(denied_.begin(), denied_.end(), report.denied) == denied_.end())
        denied_.push_back(report.denied);
    for (const MaskShift& shift : frame.mask_shifts) {
        constexpr std::size_t most = 20;
        if (!shift.automatic && !shift.limited && shift.outcome == MaskShift::Outcome::Shifted) continue;
        if (mask_shifts_.size() < most)
            mask_shifts_.push_back(fmt::format("frame {}: {}", frame.time.index, mask_shift_sentence(shift)));
        else
            ++more_mask_shifts_;
    }
    for (const Injury& injury :
         frame.simulation.injuries().all().last(static_cast<std::size_t>(report.injuries))) {
        constexpr std::size_t most = 20;
        if (injuries_.size() < most)
            injuries_.push_back(
                fmt::format("frame {}: {}", frame.time.index, sentence(injury, frame.simulation)));
        else
            ++more_injuries_;
    }
    const auto tell = [&](const std::string& change) {
        constexpr std::size_t most = 6;
        if (changes_.size() < most)
            changes_.push_back(fmt::format("frame {}: from now on {}", frame.time.index, change));
        else
            ++more_changes_;
    };
    for (const std::string& torsion : report.torsions) tell(torsion);
    if (!report.vessels.empty()) tell(report.vessels);
    gasps_ += report.breath == scenario::Breathing::Event::Gasped;
    late_ += report.waiting_insertion != 0 || report.waiting_rotation != 0;
    most_waiting_ = std::max(most_waiting_, std::abs(report.waiting_insertion));
    const bool moved = !report.settling && report.relax.newton_steps > 0;
    flat_ += moved && report.relax.at_rest() && !report.relax.converged();
    restless_ += moved && !report.relax.at_rest();
    crossed_ += report.deepest_crossing > 0;
    const Console& console = frame.simulation.console();
    limited_doses_ +=
        report.console.pulse && dose_is_limited(frame.simulation.scenario(), console.arm(), console.mode());
    deepest_crossing_ = std::max(deepest_crossing_, report.deepest_crossing);
}

std::vector<std::string> Notices::text() const {
    std::vector<std::string> result = injuries_;
    if (more_injuries_ > 0) result.push_back(fmt::format("... and {} more injuries", more_injuries_));
    const auto in_frames = [&](int count, fmt::format_string<std::string> text) {
        if (count > 0) result.push_back(fmt::format(text, frames(count)));
    };
    in_frames(stopped_withdrawals_, "withdrawal stopped at the introducer in {}");
    in_frames(past_ends_, "the tip was past an end of the vessels in {}: there they narrow and end");
    in_frames(used_up_, "insertion stopped in {}: the whole wire was in; a longer one has another length_mm");
    if (unseen_.frames > 0) {
        result.push_back(fmt::format(
            "{} in {}{}: in frame {} {} would have brought the tip to the middle; the C-arm's angle and a "
            "wider field show more too",
            wire_was_out_ ? "the beam came on with nothing of the wire in the image, and its tip was outside"
                          : "the tip was outside the image",
            frames(unseen_.frames), unseen_.episodes > 1 ? fmt::format(", {} times", unseen_.episodes) : "",
            unseen_.first, unseen_.remedy));
    }
    in_frames(kinked_,
              "the wire was bent by more than 60 degrees at one joint in {}: shorter segments or a stiffer "
              "wire would follow");
    in_frames(settling_,
              "the wire was on its way at the end of {}, as in a snap: they show it where it was last at "
              "rest; more [relaxer] updates_per_frame would let it arrive");
    if (late_ > 0) {
        result.push_back(
            fmt::format("the wire lagged behind the hand at the end of {}, by up to {:.2g} mm: the motion "
                        "waited for the wire to come to rest",
                        frames(late_), most_waiting_));
    }
    in_frames(
        buckled_,
        "a push was not passed on in {}: it asked for more than the shaft outside bears before it bows");
    in_frames(refused_, "a motion was not made in {}: it led to no rest that the wire could be in");
    in_frames(too_thick_, "a catheter stopped in {}: the vessel before its tip is narrower than it is");
    if (limited_doses_ > 0) {
        result.push_back(
            fmt::format("the detector's dose was limited to {:g} nGy in {}: magnification asked for more "
                        "than any detector takes; a lower [imaging] dose would follow the field",
                        render::largest_detector_dose, frames(limited_doses_)));
    }
    for (const std::string& text : denied_) result.push_back(text);
    for (const std::string& text : mask_shifts_) result.push_back(text);
    if (more_mask_shifts_ > 0) result.push_back(fmt::format("... and {} more shifts", more_mask_shifts_));
    for (const std::string& text : changes_) result.push_back(text);
    if (more_changes_ > 0)
        result.push_back(fmt::format("... and {} more changes of shafts and vessels", more_changes_));
    if (gasps_ > 0)
        result.push_back(
            fmt::format("the patient had to breathe {} before the breath was freed; [motion] breath_hold_s "
                        "is how long he can hold it",
                        gasps_ == 1 ? "once" : fmt::format("{} times", gasps_)));
    in_frames(flat_, "the wire rested at a flat minimum or a saddle in {}: another rest may be as near");
    in_frames(restless_,
              "the wire had not come to rest at the end of {}: a mesh's planes jump between its triangles, "
              "which a distance field does not");
    if (crossed_ > 0) {
        result.push_back(
            fmt::format("between two joints the wire crossed the wall, by up to {:.2g} mm, at the end of {}; "
                        "shorter segments follow the wall closer",
                        deepest_crossing_, frames(crossed_)));
    }
    return result;
}

}  // namespace exercise
