#pragma once
/// Pairs of a patient's picture and this program's, for people who know patients.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/io/csv.h"
#include "engine/studies/study.h"

namespace studies {

/// A picture in grey levels of 255, with the width of its pixels [mm]; the name says what it shows.
struct NamedPicture {
    std::string name;
    render::Field grey;
    double pixel = 0;
};

struct ForcedChoice {
    std::vector<StudyPicture> pairs;  // choice_01.png and so on: two windows of one size beside each other
    std::string page;                 // HTML that asks for each which side is a patient, without the answers
    io::Table answers;                // by pair: the side that is one, and what both are of
};

/// Two-alternative forced choice: each pair has a window of one of `real` and one of `own` of the same region
/// (head, chest, heart, abdomen and legs, by words in their names) and the same width in millimetres, with
/// the same greys at its first and 99th percentile, on a side and at a place drawn from `seed`.
ForcedChoice forced_choice(std::span<const NamedPicture> real, std::span<const NamedPicture> own, int pairs,
                           std::uint64_t seed);

}  // namespace studies
