#pragma once
/// What clinicians call the vessels that files and scripts abbreviate, the one table of these names; which
/// organ a vessel supplies, as its name says, and what it lies in.

#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "physics/wall/foundation.h"

namespace anatomy {

/// "left renal artery" for "LRA"; "aorta to left common femoral artery" for "aorta+LCIA+LEIA+LCFA", as
/// vessels are called that run on through several; a name that is no abbreviation is its own.
std::string clinical_name(std::string_view branch);
/// Of an open end: "left common femoral artery" for "aorta+LCIA+LEIA+LCFA.out", "aorta" for its ".in".
std::string clinical_end(std::string_view end);

enum class Organ { Arm, Leg, Kidney, Brain, Gut, Heart, Trunk };

/// "arm", "leg", "kidney" …, as the patient's parts end.
std::string_view name_of(Organ);

/// Of "aorta+LCIA+LEIA+LCFA" the last part that stands for an organ decides. A vessel of unknown name
/// supplies the same organ as its parent or, failing that, an arm's muscle.
Organ organ_behind(const Anatomy&, int branch);

/// The parts of the brain that lie behind a branch, as the patient's layers are called ("left ACA",
/// "cerebellum and stem"), by the last part of its name that stands for a cerebral artery: an internal
/// carotid supplies the anterior and middle territory of its side, a vertebral or basilar artery the
/// posterior ones of both sides and what lies under the tentorium. The side is in the name or, failing that,
/// `on_left`. Empty for a name that stands for none.
std::vector<std::string> brain_territories(std::string_view branch, bool on_left);

/// For a report: which ends have an organ behind them in which contrast shows, or what a branch would have to
/// be called. Whole lines.
std::string organs_text(const Anatomy&);

/// One a branch. Where the body is not known, the head's vessels are those of the limbs and the trunk.
std::vector<physics::Tissue> tissues_of(const Anatomy&);

}  // namespace anatomy
