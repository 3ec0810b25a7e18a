#pragma once
/// Generated anatomies that tests and benchmarks share, kept in build/cache from one run to the next.

#include "engine/anatomy/generate_run.h"
#include "engine/anatomy/vessel_presets.h"

namespace engine::test {

inline ModelCache cache() {
    return {SELDINGER_SOURCE "/build/cache", {}};
}

/// From both groins to the renal arteries; ends aorta+LCIA+LEIA+LCFA.in, …out, RCIA+REIA+RCFA.out, ….
inline const Anatomy& iliac_renal() {
    static const Anatomy anatomy = generated_anatomy(vessel_preset("iliac-renal"), cache());
    return anatomy;
}

}  // namespace engine::test
