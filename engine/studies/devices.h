#pragma once
/// What friction and torsion do to a wire, against closed forms, and what each costs.

#include "engine/studies/study.h"

namespace studies {

/// Its pictures read the tables devices_capstan, devices_loop, devices_whip and devices_cost.
StudyResult run_devices(const StudyOptions&);

}  // namespace studies
