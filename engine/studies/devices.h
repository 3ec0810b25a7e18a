#pragma once
/// What friction, torsion and a catheter do to a wire, against closed forms, and what each costs.

#include "engine/studies/study.h"

namespace studies {

/// Its pictures read the tables devices_capstan, devices_loop, devices_whip, devices_cost, devices_held,
/// devices_snap and devices_tubes.
StudyResult run_devices(const StudyOptions&);

}  // namespace studies
