#pragma once
/// Generated anatomies that tests and benchmarks share, kept in build/cache from one run to the next.

#include "engine/anatomy/generate_run.h"
#include "engine/anatomy/vessel_presets.h"

namespace test {

inline engine::ModelCache cache() {
    return {SELDINGER_SOURCE "/build/cache", {}};
}

/// From both groins to the renal arteries; ends aorta+LCIA+LEIA+LCFA.in, …out, RCIA+REIA+RCFA.out, ….
inline const engine::Anatomy& iliac_renal() {
    static const engine::Anatomy anatomy =
        engine::generated_anatomy(engine::vessel_preset("iliac-renal"), cache());
    return anatomy;
}

}  // namespace test
