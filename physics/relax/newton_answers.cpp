/// What the model of a chain at rest answers, to first order, to a change of the gradient.

#include <cassert>
#include <cmath>

#include "physics/relax/newton_model.h"

namespace physics {

void NewtonModel::forget_gradient() {
    for (RiccatiStage& s : terms_.stages) s.slope.setZero(), s.slope_prev.setZero(), s.force.setZero();
    for (FrameStage& s : terms_.frame_stages) s.slope = s.twist_slope = s.grip_slope = 0;
}

/// The trial state becomes a small part of the answer to the gradient that the stages have, and to that of
/// the springs at the base. Returns that part [-]; 0 where there is no answer.
double NewtonModel::answer_in_small(const Chain& wire, FrameVector springs) {
    assert(terms_.first == 1 && mu_ == 0);
    const FrameVector slopes =
        riccati_answer(terms_.stages, 0, 0, false, least_pivot, gains_, terms_.framed(1, frame_gains_), {});
    for (int f = 0; f < terms_.frames.count; ++f) springs[f] += slopes[f];
    solve_base(wire, springs, 0, nullptr);
    // So far the largest move of a joint is straight to 1e-5 of it, and far above rounding [mm].
    constexpr double straight = 1e-5;
    constexpr int most_tries = 4;  // a long answer is not in proportion
    double part = 1;
    for (int k = 0; k < most_tries; ++k) {
        const double farthest = roll_out(wire);
        if (!std::isfinite(farthest)) return 0;
        if (farthest == 0 || (k > 0 && farthest <= 2 * straight)) return part;
        const double by = straight / farthest;
        part *= by;
        for (RiccatiGain& gain : gains_) gain.step *= by;
        for (FrameGain& gain : frame_gains_) gain.step *= by;
        for (double& turn : trial_.turns_at_base) turn *= by;
    }
    return 0;
}

std::optional<std::vector<Vec3>> NewtonModel::moves_in_small(const Chain& rest, const FrameVector& springs) {
    const double part = answer_in_small(rest, springs);
    if (part == 0) return {};
    std::vector<Vec3> moves(rest.joints.size(), Vec3::Zero());
    for (std::size_t j = 1; j < moves.size(); ++j) moves[j] = (trial_.joints[j] - rest.joints[j]) / part;
    return moves;
}

std::optional<std::vector<Vec3>> NewtonModel::moved_by(const Chain& rest, const Chain& changed,
                                                       const ContactSet& contacts) const {
    NewtonModel now = *this, after = *this;
    after.update_slopes(changed, contacts);
    // What the gradient changes by; rest itself is only nearly one.
    NewtonTerms& terms = now.terms_;
    for (std::size_t j = 0; j < terms.stages.size(); ++j) {
        RiccatiStage& s = terms.stages[j];
        const RiccatiStage& to = after.terms_.stages[j];
        s.slope = to.slope - s.slope;
        s.slope_prev = to.slope_prev - s.slope_prev;
        s.force = to.force - s.force;
    }
    for (std::size_t k = 0; k < terms.frame_stages.size(); ++k) {
        FrameStage& s = terms.frame_stages[k];
        const FrameStage& to = after.terms_.frame_stages[k];
        s.slope = to.slope - s.slope;
        s.twist_slope = to.twist_slope - s.twist_slope;
        s.grip_slope = to.grip_slope - s.grip_slope;
    }
    FrameVector springs = with_springs(changed, {});
    const FrameVector before = with_springs(rest, {});
    for (int f = 0; f < most_devices; ++f) springs[f] -= before[f];
    return now.moves_in_small(rest, springs);
}

std::optional<std::vector<Vec3>> NewtonModel::moved_with(const Chain& rest,
                                                         std::span<const Vec3> walls) const {
    assert(walls.size() == rest.joints.size());
    NewtonModel now = *this;
    now.forget_gradient();
    const int count = terms_.frames.count;
    for (std::size_t j = 0; j < now.terms_.stages.size(); ++j) {
        RiccatiStage& s = now.terms_.stages[j];
        if (!s.touches) continue;
        s.force = -s.stiffness * walls[j + 1];
        if (!terms_.frames.each) continue;
        for (int f = 0; f < count; ++f) {
            FrameStage& frame = now.terms_.frame_stages[j * count + f];
            if (frame.twist_stiffness > 0) frame.grip_slope = -frame.grip_cross.dot(walls[j + 1]);
        }
    }
    return now.moves_in_small(rest, {});
}

std::optional<std::vector<Vec3>> NewtonModel::pushed_by(const Chain& rest,
                                                        std::span<const Vec3> gradients) const {
    assert(gradients.size() == rest.joints.size());
    NewtonModel now = *this;
    now.forget_gradient();
    for (std::size_t j = 0; j < now.terms_.stages.size(); ++j)
        if (now.terms_.stages[j].touches) now.terms_.stages[j].force = gradients[j + 1];
    return now.moves_in_small(rest, {});
}

std::vector<double> NewtonModel::parts_along(const Chain& wire, const Vec3& direction) const {
    // The Hessian is symmetric: its answer to a force on the tip weighs every gradient.
    NewtonModel answer = *this;
    answer.forget_gradient();
    answer.terms_.stages.back().touches = true;
    answer.terms_.stages.back().force = direction;  // [N]
    std::vector<double> parts(wire.joints.size(), 0.0);
    const double part = answer.answer_in_small(wire, {});
    if (part == 0) return parts;
    for (std::size_t j = 1; j < parts.size(); ++j)
        parts[j] = terms_.gradient[j - 1].dot(answer.trial_.turns[j]) / part;
    return parts;
}

}  // namespace physics
