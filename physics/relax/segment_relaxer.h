#pragma once
/// The paper's relaxer: M varied segments at a time (Sections 2.2 and 2.3), first or second order.

#include <array>
#include <memory>

#include "physics/relax/contact_set.h"
#include "physics/relax/relaxer.h"
#include "physics/relax/schedule.h"
#include "physics/relax/segment_step.h"
#include "physics/wire/bending.h"

namespace physics {

/// Least and largest separation that Algorithm 2 looks at.
inline constexpr int kLeastSeparation = 5, kLargestSeparation = 25;

class SegmentRelaxer final : public Relaxer {
public:
    explicit SegmentRelaxer(const RelaxerConfig& config);

    RelaxReport relax(Guidewire&, const LumenWall&, const RelaxBudget&, const UpdateObserver& = {}) override;

    /// The varied segments of the last update, for the separation studies.
    std::span<const int> last_varied() const { return {varied_.data(), static_cast<std::size_t>(count_)}; }

private:
    using Tangents = std::array<Vec3, kMostVariedSegments>;
    // Contacts is ContactSet, or StoredPlanes for the faster form.
    template <class Contacts>
    RelaxReport sweep(Guidewire&, Contacts, const RelaxBudget&, const UpdateObserver&);
    template <class Contacts>
    void begin(Guidewire&, Contacts&);
    template <class Contacts>
    void choose_segments(const Guidewire&, const Contacts&, int segment);
    template <class Contacts>
    bool select_by_estimate(const Guidewire&, const Contacts&, int last, Vec3& turn);
    template <class Contacts>
    SegmentProblem local_problem(const Guidewire&, const Contacts&, const PushSum& beyond) const;
    Tangents solve(const Guidewire&, const SegmentProblem&) const;
    template <class Contacts>
    double update(Guidewire&, Contacts&, int segment, RelaxReport&);
    template <class Contacts>
    double turn_segments(Guidewire&, Contacts&, int segment, RelaxReport&);
    template <class Contacts>
    double turn_piece(Guidewire&, Contacts&, int segment, RelaxReport&);
    template <class Contacts>
    bool try_turn(Guidewire&, Contacts&, const Tangents& target, int last, bool must_descend);
    double largest_turn(const Guidewire&, const SegmentProblem& before) const;
    void refresh_tip(const Guidewire&, int first);

    RelaxerConfig config_;
    Schedule schedule_;
    int count_ = 0;  // varied segments of this update
    std::array<int, kMostVariedSegments> varied_{};
    // scratch, kept between calls
    std::vector<Vec3> directors_, old_directors_;
    std::vector<double> torque_;
    double since_sweep_ = 0;  // largest turn since the whole-wire sweep began
};

}  // namespace physics
