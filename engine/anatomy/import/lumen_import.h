#pragma once
/// Turns the mesh of a lumen into an anatomy.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/import/mesh_repair.h"
#include "engine/anatomy/import/naming.h"

namespace anatomy {

struct ImportOptions {
    std::string unit;                     // of the mesh's numbers: mm, cm or m
    std::optional<geometry::Vec3> inlet;  // near the end where wires enter [mm]; default: the largest end
    std::vector<geometry::Vec3> ends;     // near blind tips that are cut open [mm]; default: all that are no
                                          // sacs, where ends are missing (end_choice.h)
    bool open_tubes = false;              // cut all blind tips open that are ends of tubes
    FileFrame frame;                      // of the mesh's and the centrelines' numbers; no file may state
                                          // other axes than are given
    std::vector<NamedPlace> names;        // of ends, in the patient's frame
    std::vector<std::filesystem::path> places;       // points as load_places reads them: of ends and targets
    std::vector<std::filesystem::path> centrelines;  // as load_centrelines reads them; none = they are traced
    int threads = 2;                                 // the anatomy has the same bits for any number
    std::function<void(double part, const char* what)> progress;
};

struct ImportedLumen {
    Anatomy anatomy;  // branches B1, B2 … by distance of their start from the inlet, ends END1 (the inlet),
                      // END2 … in the order of their branches, a target near each tip, unless give_names()
                      // has found names
    std::vector<Finding> findings;  // what was found and repaired, in the order of the work
    std::vector<Check> checks;      // of the anatomy; none fails
    std::string axes;               // that the mesh's numbers were taken in
};

/// Repairs the surface, takes off flat caps, finds ends and branches, cuts off what no wire can enter and
/// checks the result. A lumen whose ends are missing is cut open at its tips. Throws InputError for an
/// unusable mesh: what was found, where, and what is accepted.
ImportedLumen import_lumen(const std::filesystem::path& mesh, const ImportOptions&);

/// The same for a mesh in memory, in millimetres whatever `unit` was given, in the patient's frame.
/// Centrelines that do not state their axes have those given. `found`: what is known about the mesh already.
ImportedLumen import_lumen(const geometry::TriangleMesh&, const std::string& name, const ImportOptions&,
                           const std::string& axes = "lps", std::vector<Finding> found = {});

}  // namespace anatomy
