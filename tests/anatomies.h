#pragma once
/// Generated anatomies that tests and benchmarks share, kept in build/cache from one run to the next.

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"

namespace test {

inline anatomy::ModelCache cache() {
    return {SELDINGER_SOURCE "/build/cache", {}};
}

/// From both groins to the renal arteries; ends aorta+LCIA+LEIA+LCFA.in, …out, RCIA+REIA+RCFA.out, ….
inline const anatomy::Anatomy& iliac_renal() {
    static const anatomy::Anatomy anatomy =
        anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), cache());
    return anatomy;
}

}  // namespace test
