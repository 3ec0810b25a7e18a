#pragma once
/// The paper's relaxer: M varied segments at a time (Sections 2.2 and 2.3), first or second order.

#include <array>
#include <concepts>
#include <memory>

#include "physics/relax/contact_set.h"
#include "physics/relax/relaxer.h"
#include "physics/relax/schedule.h"
#include "physics/relax/segment_step.h"
#include "physics/wire/bending.h"

namespace physics {

/// Least and largest separation that Algorithm 2 looks at.
inline constexpr int least_separation = 5, largest_separation = 25;

/// The interface to a wire's contacts that a sweep of updates needs: ContactSet, or StoredPlanes for the
/// faster form. `first` and `last` are joints, `segment` is the one updated next.
template <class Contacts>
concept SweepContacts = requires(Contacts& contacts, const Contacts& known, Chain& wire,
                                 std::span<const TailStep> steps) {
    contacts.reset(wire);
    contacts.start_sweep(wire, 1);
    contacts.settle(wire, 1);  // puts the joints proximal of it in place
    contacts.settle_all(wire);
    { contacts.settled(wire) } -> std::convertible_to<const Chain&>;
    { known.energy(wire, 1, 1) } -> std::same_as<double>;
    { contacts.move(wire, steps, 1) } -> std::same_as<double>;  // commit() or undo() follows
    contacts.commit();
    contacts.undo(wire);
    { known.sum_from(1) } -> std::same_as<PushSum>;
    { known.last_touching() } -> std::same_as<int>;
    { known.touching() } -> std::same_as<int>;
    { known.load_scale(1) } -> std::same_as<double>;
    { known.contacts() } -> std::convertible_to<std::span<const WallContact>>;
    { known.queries() } -> std::convertible_to<long long>;
};

class SegmentRelaxer final : public Relaxer {
public:
    SegmentRelaxer(const RelaxerConfig&, const LumenWall&);

    RelaxReport relax(Chain&, const RelaxBudget&, const UpdateObserver& = {}) override;

    void state(StateStream& s) override { s(schedule_); }

    /// The varied segments of the last update, for the separation studies.
    std::span<const int> last_varied() const { return {varied_.data(), static_cast<std::size_t>(count_)}; }

private:
    using Tangents = std::array<Vec3, most_varied_segments>;
    template <SweepContacts Contacts>
    RelaxReport sweep(Chain&, Contacts, const RelaxBudget&, const UpdateObserver&);
    template <SweepContacts Contacts>
    void begin(Chain&, Contacts&);
    template <SweepContacts Contacts>
    void choose_segments(const Chain&, const Contacts&, int segment);
    template <SweepContacts Contacts>
    bool select_by_estimate(const Chain&, const Contacts&, int last, Vec3& turn);
    template <SweepContacts Contacts>
    SegmentProblem local_problem(const Chain&, const Contacts&, const PushSum& beyond) const;
    Tangents solve(const Chain&, const SegmentProblem&) const;
    template <SweepContacts Contacts>
    double update(Chain&, Contacts&, int segment, RelaxReport&);
    template <SweepContacts Contacts>
    double turn_segments(Chain&, Contacts&, int segment, RelaxReport&);
    template <SweepContacts Contacts>
    double turn_piece(Chain&, Contacts&, int segment, RelaxReport&);
    template <SweepContacts Contacts>
    bool try_turn(Chain&, Contacts&, const Tangents& target, int last, bool must_descend);
    double largest_turn(const Chain&, const SegmentProblem& before) const;
    void refresh_tip(const Chain&, int first);

    RelaxerConfig config_;
    const LumenWall& wall_;
    Schedule schedule_;
    int count_ = 0;  // varied segments of this update
    std::array<int, most_varied_segments> varied_{};
    // scratch, kept between calls
    std::vector<Vec3> directors_, old_directors_;
    std::vector<double> torque_;
    double since_sweep_ = 0;  // largest turn since the whole-wire sweep began
};

}  // namespace physics
