#pragma once
/// A mesh of a lumen in, an anatomy out.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy_check.h"
#include "engine/anatomy/import/mesh_repair.h"

namespace anatomy {

struct ImportOptions {
    std::string unit;                     // of the mesh's numbers: mm, cm or m
    std::optional<geometry::Vec3> inlet;  // near the end that wires come in by [mm]; else the largest end
    std::filesystem::path centrelines;    // as load_centrelines reads them; empty = they are found
    int threads = 2;                      // the anatomy has the same bits for any number
    std::function<void(double part, const char* what)> progress;
};

struct ImportedLumen {
    Anatomy anatomy;  // branches B1, B2 … by how far from the inlet they start, ends END1 (the
                      // inlet), END2 … in the order of their branches, a target near each tip
    std::vector<Finding> findings;  // what was found and mended, in the order of the work
    std::vector<Check> checks;      // of the anatomy; none fails
};

/// Mends the surface, finds its ends and branches and checks the result. A closed lumen is cut open at its
/// tips. Throws InputError for what cannot be used: what was found, where, and what is accepted.
ImportedLumen import_lumen(const std::filesystem::path& mesh, const ImportOptions&);

/// The same for a mesh at hand, in millimetres whatever `unit` says it was.
ImportedLumen import_lumen(const geometry::TriangleMesh&, const std::string& name, const ImportOptions&);

}  // namespace anatomy
