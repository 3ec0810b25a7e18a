#pragma once
/// Hands and feet of the trainee: turns what is held and pressed during one frame into commands of a script.

#include <array>
#include <bitset>
#include <optional>
#include <utility>
#include <vector>

#include "engine/exercise/simulation.h"
#include "engine/room/grasp.h"
#include "engine/room/keys.h"
#include "engine/script/command.h"
#include "render/panel/readout.h"

namespace room {

/// What happened since the last frame. Keys that went down and up again within a frame count as held for it.
struct Input {
    std::bitset<actions> held;
    std::vector<Action> pressed;            // in order
    std::vector<int> injections;            // indices in the key map, in order
    double wheel = 0;                       // notches, away from the hand positive
    double drag_up = 0, drag_right = 0;     // of the mouse on the image [pixels]
    std::array<double, 2> push{}, turn{};   // of a gamepad's stick for each Side, -1 to 1
    double arm_lao = 0, arm_cranial = 0;    // requested on the pictogram [rad]
    double table_left = 0, table_head = 0;  // by dragging [mm]

    bool holds(Action a) const { return held.test(static_cast<std::size_t>(a)); }
    /// Adds later input: movements are summed, what was held or pressed stays.
    void add(const Input& later);
};

/// What the trainee is told of what his hands did or could not do.
using Messages = std::vector<render::Message>;

class Hands {
public:
    /// `frame_time` [s].
    Hands(KeyMap, double frame_time);

    /// The commands of the next frame; `last` is what the previous frame did. Motions that the stand or the
    /// patient could not follow are not commanded; `messages` then says so, and who holds what or what is
    /// injected once that changes. Both hands act in a frame, the right one first, and wait for devices that
    /// lag far behind.
    std::vector<script::Command> commands(const Input&, const exercise::Simulation&,
                                          const exercise::StepReport& last, Messages& messages);
    /// No key is held any more.
    void rest();
    const KeyMap& keys() const { return keys_; }
    /// Who holds what; null before the first frame.
    const Grasp* grasp() const { return grasp_ ? &*grasp_ : nullptr; }

private:
    struct Hand {
        double push_since = 0, turn_since = 0;  // held [s]
    };
    /// A key that does one step when it goes down, and others at even times while it stays down.
    struct Repeated {
        bool held = false;
        double left = 0;  // until the next one [s]
    };
    double run_up(bool held, double& since) const;
    bool is_due(bool held, Repeated&) const;
    std::pair<double, double> motion(Side, const Input&);
    void move_device(Side, const Input&, const exercise::StepReport& last, std::vector<script::Command>&,
                     Messages& messages);
    void press_pedals(const Input&, const exercise::Simulation&, std::vector<script::Command>&,
                      Messages& messages);
    void change_grasp(Action, const exercise::Simulation&, Messages& messages);
    void move_grip(const Input&, const exercise::Simulation&, std::vector<script::Command>&,
                   Messages& messages) const;
    void shift_mask(const Input&, std::vector<script::Command>&) const;
    void move_stand(const Input&, const exercise::Simulation&, std::vector<script::Command>&,
                    Messages& messages);
    void inject(const Input&, const exercise::Simulation&, std::vector<script::Command>&,
                Messages& messages) const;
    void treat(const Input&, const exercise::Simulation&, std::vector<script::Command>&, Messages& messages);
    void take_next_balloon(const exercise::Simulation&, std::vector<script::Command>&,
                           Messages& messages) const;

    KeyMap keys_;
    double frame_time_;
    std::array<Hand, 2> hands_;
    Repeated inflates_, deploys_;
    std::optional<Grasp> grasp_;
    bool wants_roadmap_ = false;
    bool acquires_ = false;
    std::optional<script::ImagingMode> acquisition_;  // as chosen by key; empty = the scenario's
};

}  // namespace room
