#include "physics/wall/wall.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace physics {

void require_finite(std::span<const Vec3> joints) {
    double none = 0;  // a number times zero, summed: not zero where one of them is not finite
    for (const Vec3& x : joints) none += 0 * x[0] + 0 * x[1] + 0 * x[2];
    if (none == 0) return;
    for (std::size_t i = 0; i < joints.size(); ++i) {
        if (joints[i].allFinite()) continue;
        std::ostringstream text;
        text << "a wall was asked at a position that is not finite, (" << joints[i].x() << ", "
             << joints[i].y() << ", " << joints[i].z() << ") mm, joint " << i << " of " << joints.size()
             << " asked";
        throw std::logic_error(text.str());
    }
}

}  // namespace physics
