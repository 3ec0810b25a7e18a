#pragma once
/// What a teacher makes happen to the patient: spasm, thrombus, dissection, breath. The commands are in
/// engine/script/command.h; what each does and where its amounts come from is in docs/complications.md.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/blood/blood_flow.h"
#include "engine/exercise/branch_stretch.h"
#include "engine/script/command.h"
#include "physics/geometry/state.h"
#include "physics/wall/narrowed_wall.h"
#include "physics/wire/chain.h"

namespace exercise {

/// One that was set in the attempt.
struct Complication {
    script::ComplicationKind kind = script::ComplicationKind::Spasm;
    int branch = -1;                                           // of the anatomy; -1 of the breath
    double at = 0, over = 0, percent = 0;                      // as the command says [mm], [mm], [percent]
    script::BreathManner breath = script::BreathManner::Free;  // of the breath: Deep or Cough
    int since = 0;                                             // frame of the attempt
    int relieved = -1;                // frame of the attempt at which it was taken back; -1 = it is set
    bool held_off = false;            // devices in it have kept it from narrowing as far as it was asked to
    double come = 0;                  // fraction of it that has come, and has not gone yet [-]
    std::vector<double> closed = {};  // the same at each place along it, as devices let it

    bool set() const { return relieved < 0; }
    /// Nothing of it is left in the vessels.
    bool gone() const { return !set() && come == 0; }
    bool operator==(const Complication&) const = default;
    void state(geometry::StateStream& s) {
        s(kind, branch, at, over, percent, breath, since, relieved, held_off, come, closed);
    }
};

/// "spasm of the left renal artery"; "deep breathing", "cough".
std::string name_of(const Complication&, const anatomy::Anatomy&);

/// Those of an attempt. They come and go over `time_to_come`, as far as that moves no wall by more than
/// `largest_move` in a frame.
class Complications {
public:
    static constexpr double time_to_come = 2;    // [s]
    static constexpr double largest_move = 0.2;  // of the lumen's wall in a frame [mm]
    static constexpr double room_left = 0.1;     // around a device that lies in a narrowing [mm]

    /// The problem with the command in these vessels; empty where there is none.
    static std::string problem(const script::Complicate&, const anatomy::Anatomy&);
    static std::string problem(const script::Relieve&, const anatomy::Anatomy&);

    /// Sets one; without a problem(). Others of the same kind in the same branch are relieved, but those that
    /// `stays` is true of.
    void set(const script::Complicate&, const anatomy::Anatomy&, int frame,
             const std::function<bool(const Complication&)>& stays = {});
    /// All of a kind in a branch, or all.
    void relieve(const script::Relieve&, const anatomy::Anatomy&, int frame);
    /// One of all().
    void relieve(std::size_t which, int frame);

    /// All of the attempt, in order; those that are set() now are a teacher's list.
    std::span<const Complication> all() const { return all_; }
    /// Whether vessels have, or are to have, something that anatomy() does not.
    bool in_vessels() const;
    /// They come and go by a frame of `seconds`, as far as the devices leave them room. Whether something has
    /// changed in the vessels.
    bool step(double seconds, const physics::Chain&);
    std::vector<physics::Narrowing> narrowings() const;
    std::vector<blood::Obstruction> obstructions() const;
    /// As an image shows them: they have come in quarters.
    Complications as_seen() const;
    void clear() { *this = Complications(); }
    /// Makes again what follows from the state.
    void find_places(const anatomy::Anatomy&);

    void state(geometry::StateStream& s) { s.unless_empty(all_); }

private:
    static BranchStretch place_of(const Complication&, const anatomy::Anatomy&);
    struct Room {
        std::vector<double> devices, balloon;
    };
    static Room room_for(const physics::Chain&, const Complication&, const BranchStretch&);
    static bool move(Complication&, const BranchStretch&, const physics::Chain&, double seconds);

    std::vector<Complication> all_;
    std::vector<BranchStretch> places_;  // of each; empty for one that is gone
};

}  // namespace exercise
