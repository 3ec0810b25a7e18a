#pragma once
/// The studies that the registry lists.

#include "engine/studies/study.h"

namespace studies {

/// Every way of breaking a method against every method.
StudyResult run_stability(const StudyOptions&);
/// Speed against accuracy: processor time and counted work until the farthest joint stays within a distance
/// of rest, for every method of the paper, the global relaxer, and the classical rods that the paper names.
StudyResult run_pareto(const StudyOptions&);
/// How far a chain of segments is from the exact wire: by the length of its segments, by what its first and
/// last joint stand for, and by the processor time of a method.
StudyResult run_accuracy(const StudyOptions&);
/// For every preset: time, triangles, angles, distance from the implicit surface, topology; and the same
/// re-imported from its mesh, clean and corrupted: time, branches, ends, distance from the true centrelines,
/// radii. Includes meshes from elsewhere where options.real_meshes has them. For two presets, also how well
/// the walls of a simulation distinguish inside from outside.
StudyResult run_anatomy(const StudyOptions&);
/// A hundred patients of every preset: whether all can be grown, how many draws were rejected, means and
/// spreads of their dimensions against published ones, correlations between consecutive seeds and with age
/// and height; and the surfaces of some.
StudyResult run_patients(const StudyOptions&);
/// 20 000 pushes of one segment through random tubes, and 12 000 frames of wild hands in the scenarios of
/// options.scenarios and in the meshes of options.real_meshes, where these exist; quick: 300 and 150. The
/// same on any number of threads, times aside.
StudyResult run_robustness(const StudyOptions&);
/// Thirteen things that devices do in hands, from whip to wedge, in exercises that ship, beside published
/// sizes; what 20 000 frames of hands at the speeds of physicians feel; the balance of energy. quick: longer
/// steps and 200 frames. The same on any number of threads.
StudyResult run_hands(const StudyOptions&);
/// What choosing λ by the anatomy and coarsening the wire where it is straight save, and what they cost in
/// accuracy.
StudyResult run_economy(const StudyOptions&);
/// What each simplification of the model costs in accuracy and saves in time, in every exercise that ships
/// with its solution's commands, and whether the errors that `auto` states hold. quick: two exercises, their
/// first second. The same on any number of threads, times aside.
StudyResult run_models(const StudyOptions&);
/// What friction, torsion and a catheter do to a wire, against closed forms, and what each costs.
StudyResult run_devices(const StudyOptions&);
/// Whether frames agree with physics, and what they cost.
StudyResult run_imaging(const StudyOptions&);
/// The patient of each region from several sides, and a coronary artery in cine: noise, greys, edges and
/// octaves, beside those of the PNG pictures in options.pictures.
StudyResult run_realism(const StudyOptions&);
/// Relaxation on walls of triangles, as the paper's are.
StudyResult run_triangle_walls(const StudyOptions&);

/// The paper's Figures 4 to 18, its Table 1 and the numbers of its Section 3.
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

/// The parts of the study of images, each with its tables, pictures and the text that goes with them.
constexpr double imaging_kvp = 74;  // for figures that are given for one voltage only

StudyResult imaging_lengths(const StudyOptions&);  // path lengths: closed forms, ray tracer, balance
StudyResult imaging_wire(const StudyOptions&);     // the wire's shadow: supersampled rays
StudyResult imaging_bins(const StudyOptions&);     // energies: the full spectrum
StudyResult imaging_noise(const StudyOptions&);    // noise: its variance and power spectrum
StudyResult imaging_times(const StudyOptions&);    // what each stage costs

}  // namespace studies
