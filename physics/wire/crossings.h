#pragma once
/// Segments that pass through the wall between two joints inside the lumen, as across a carina, where no
/// joint feels them. They are found by asking the wall along the segment, and mended by a joint at their
/// deepest place.

#include <optional>
#include <span>
#include <vector>

#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

/// A crossing no deeper than this is left alone [mm]. A wall rounds a carina off by up to as much again, so
/// that no crossing deeper than 0.1 mm in the vessel passes.
constexpr double crossing_tolerance = 0.05;

constexpr double least_piece = 0.125;  // of λ: no segment is split into shorter ones

struct Crossing {
    int segment = 0;
    double fraction = 0;  // of the segment's length that lies proximal of its deepest place
    double depth = 0;  // there, beyond what the ends' forces explain: penetration less the ends' larger [mm]
};

/// The deepest place of a straight line through the wall, if it lies deeper than its ends by more than the
/// tolerance; `segment` stays 0. The contacts are those of its ends. The wall is not asked where the ends'
/// trust covers the whole line. Between two places asked for, the wall is bounded by its slope, at most 1.1,
/// and near it by its normal and the lumen's width: the search ends where nothing deeper can hide.
std::optional<Crossing> crossing_between(const LumenWall&, const Vec3& from, const Vec3& to,
                                         const WallContact& at_from, const WallContact& at_to,
                                         double tolerance = crossing_tolerance);

/// The crossings of a wire whose joints have these contacts, in order.
std::vector<Crossing> crossings(const Chain&, std::span<const WallContact>, const LumenWall&,
                                double tolerance = crossing_tolerance);

/// Puts a joint at each of the crossings, which are those of the wire in order; a segment longer than the
/// chain's λ is halved instead, as refine() would. Pieces shorter than an eighth of λ are not made. Relax the
/// wire afterwards. Returns the number of segments split.
int split_crossings(Chain&, std::span<const Crossing>);

/// Puts joints into segments that would cross a wall nearer by a quarter of λ, so that what comes to touch a
/// carina is already short. A crossing that is found when it is there gives the chain, with the joint that
/// mends it, an energy that no hand has spent. Relax the wire afterwards. Returns the number of splits.
int split_before_edges(Chain&, const LumenWall&, double tolerance = crossing_tolerance);

/// Merges the pieces of segments that were split, where the joint between them would touch nothing and the
/// straight segment cross nothing by more than half the tolerance if the wall were nearer by 0.4 λ; with
/// `every`, all of them. Returns the number of joints removed.
int merge_pieces(Chain&, const LumenWall&, bool every = false, double tolerance = crossing_tolerance);

}  // namespace physics
