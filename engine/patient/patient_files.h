#pragma once
/// Which files a patient comes from.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/io/error.h"
#include "physics/geometry/vec.h"
#include "render/xray/materials.h"

namespace patient {

/// A closed surface of one material inside another.
struct PatientMesh {
    std::filesystem::path file;
    render::Material material = render::Material::CorticalBone;
    render::Material inside = render::Material::SoftTissue;
    std::string axes;                  // lps or ras; empty = as the file states, else lps
    double unit = 1;                   // of the file's numbers [mm]
    geometry::Vec3 shift{0, 0, 0};     // after the turn, before those of all files [mm]
    geometry::Vec3 rotation{0, 0, 0};  // about x, then y, then z of the patient's axes [rad]
    io::TextPlace place = {};          // where the scenario asks for it
};

/// What a scenario's [patient] says.
struct PatientFiles {
    std::filesystem::path ct;          // empty: the body is procedural
    std::string series;                // of a folder of DICOM files
    bool keep_table = false;           // what lies outside the body stays
    bool keep_contrast = false;        // so does contrast in the lumen
    bool partial = false;              // the CT shows only some of the vessels
    geometry::Vec3 shift{0, 0, 0};     // from the files' coordinates to the anatomy's, after the turn [mm]
    geometry::Vec3 rotation{0, 0, 0};  // about x, then y, then z of the files' coordinates [rad]
    std::vector<PatientMesh> meshes;
    std::uint64_t content = 0;  // hash of all files
    io::TextPlace place = {};   // where the scenario asks for the CT
};

/// A turn about x, then y, then z [rad].
inline geometry::Mat3 turn_by(const geometry::Vec3& rotation) {
    return (Eigen::AngleAxisd(rotation.z(), geometry::Vec3::UnitZ()) *
            Eigen::AngleAxisd(rotation.y(), geometry::Vec3::UnitY()) *
            Eigen::AngleAxisd(rotation.x(), geometry::Vec3::UnitX()))
        .toRotationMatrix();
}

/// The CT with what its header names, and the meshes.
std::vector<std::filesystem::path> inputs_of(const PatientFiles&);

/// Hash of the bytes of a file, of a detached header's data too, or of all files of a folder. Throws
/// InputError when they cannot be read.
std::uint64_t content_hash(const std::filesystem::path&);

}  // namespace patient
