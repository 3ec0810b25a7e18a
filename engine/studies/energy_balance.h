#pragma once
/// The work of the hand on a chain of devices, against what becomes of it.

#include <string>
#include <vector>

namespace studies {

/// What lets a shaft twist.
enum class WindUp { None, Whole, Segments };
const char* name_of(WindUp);

/// One device of a chain moved by small steps with the others held.
struct Balance {
    int devices = 1;  // on the chain: a wire, in a catheter, in a micro-catheter in a catheter
    double friction = 0;
    WindUp windup = WindUp::None;
    int moved = 0;                          // index of the device
    std::string motion;                     // in, turned or out
    double work = 0, gained = 0, loss = 0;  // of the hand; of the energy; by friction [N·mm]
    double traffic = 0;   // Σ over steps of the larger of |work| and |gained| + loss [N·mm]
    double missing = 0;   // Σ over steps of |work − gained − loss| [N·mm]
    int not_at_rest = 0;  // steps
    double off() const { return missing / traffic; }
};

/// Each device of a chain in a bent vessel, fed in by 10 mm, turned by 40° and drawn back. Work is summed by
/// the trapezoidal rule: where the push jumps, as where an end passes a joint that touches, it is off by the
/// jump times half a step.
std::vector<Balance> energy_balances(int devices, double friction, WindUp);

}  // namespace studies
