#include "engine/room/handling.h"

namespace room {

void Handling::observe(const exercise::Frame& frame) {
    const exercise::StepReport& report = frame.motion;
    if (report.reset) {
        const int kept = taken_back;
        *this = {};
        taken_back = kept;
    }
    const bool moves = !report.insertions.empty() || report.rotation != 0;
    const bool blind = moves && !frame.simulation.console().beam_on();
    const bool stopped =
        report.insertion_stopped || report.withdrawal_stopped || report.whole_wire_is_in || report.buckled;
    blind_motions += blind && !moves_blind;
    against_stops += stopped && !at_stop;
    moves_blind = blind || (moves_blind && !moves && !frame.simulation.console().beam_on());
    at_stop = stopped;
}

}  // namespace room
