#pragma once
/// Which organ a vessel supplies: its branch's name says so.

#include <optional>
#include <string>
#include <string_view>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

enum class Organ { Arm, Leg, Kidney, Brain, Gut, Heart, Trunk };

/// "arm", "leg", "kidney" …, as the patient's parts end.
std::string_view name_of(Organ);

/// Of "aorta+LCIA+LEIA+LCFA" the last part that stands for an organ decides. A vessel of unknown name
/// supplies the same organ as its parent or, failing that, an arm's muscle.
Organ organ_behind(const Anatomy&, int branch);

/// For a report: which ends have an organ behind them in which contrast shows, or what a branch would have to
/// be called. Whole lines.
std::string organs_text(const Anatomy&);

}  // namespace anatomy
