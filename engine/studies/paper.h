#pragma once
/// The studies of the paper's results: its Figures 4 to 18, Table 1 and the numbers of its Section 3.

#include "engine/studies/study.h"

namespace studies {

StudyResult run_separation(const StudyOptions&);            // Fig. 5
StudyResult run_varied_segments(const StudyOptions&);       // Figs. 4, 6, 7, 8, 10
StudyResult run_separation_frequency(const StudyOptions&);  // Fig. 9
StudyResult run_pair_relaxation(const StudyOptions&);       // Section 2.3.1, Fig. 3
StudyResult run_static_contact(const StudyOptions&);        // Figs. 11, 12
StudyResult run_resolution(const StudyOptions&);            // Fig. 13
StudyResult run_wall_variation(const StudyOptions&);        // Figs. 14 to 18
StudyResult run_paper_tubes(const StudyOptions&);           // Figs. 13 and 18 together
StudyResult run_cost(const StudyOptions&);                  // Table 1

extern const PieceWork wall_variation_pieces;  // a realisation each

}  // namespace studies
