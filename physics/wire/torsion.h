#pragma once
/// A device's shaft becomes another model of itself: rigid, wound up as a whole, or twisted segment by
/// segment.

#include "physics/wire/chain.h"

namespace physics {

/// The models, from the least to the most.
enum class Torsion {
    Rigid,    // turns with its hub at once
    Whole,    // winds up as a whole: one number
    Segments  // twists segment by segment, held back by the wall all along
};

/// Of the device as it is.
Torsion torsion_of(const Device&);

/// Gives the device this model from now on, with the sections of `spec`, which is the device's own with its
/// torsional rigidity. No angle is lost: the turn of the hub that has not reached the distal end stays as it
/// was, shared among the segments as a shaft without friction shares it, or summed; for a rigid shaft it goes
/// to the distal end at once. Between Whole and Segments the distal end's frame stands still. Grips begin to
/// hold the roll of the surface from where it is now, and where they no longer hold it, keep their push. The
/// chain is no longer at rest.
void change_torsion(Chain&, int device, const DeviceSpec& spec, Torsion);

/// How far the grips that the chain has can hold back the turn of a device's hub at its distal end: each
/// holds by all its force, one way, and twists the shaft between it and the hand. 0 for one that `spec` makes
/// torsionally rigid. A bound for a shaft that slides on the wall where it is now, whichever model it has
/// [rad].
double held_back(const Chain&, int device, const DeviceSpec& spec);

}  // namespace physics
