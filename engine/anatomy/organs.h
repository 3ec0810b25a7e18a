#pragma once
/// Which organ a vessel supplies: its branch's name says so.

#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

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

}  // namespace anatomy
