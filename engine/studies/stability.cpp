#include "engine/studies/stability.h"
namespace engine {
StudyResult run_stability(const StudyOptions&) {
    return {};
}
}  // namespace engine
