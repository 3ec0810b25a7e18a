#include "tests/fuzz/readers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/grow/vessel_file.h"
#include "engine/anatomy/import/given_centrelines.h"
#include "engine/anatomy/mesh_file.h"
#include "engine/io/csv.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/wall.h"
#include "engine/patient/ct_image.h"
#include "engine/room/keys.h"
#include "engine/run/batch.h"
#include "engine/run/picture_file.h"
#include "engine/scenario/device.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace fuzz {
namespace {

namespace fs = std::filesystem;

/// A folder of this process for the readers that take a path.
const fs::path& folder() {
    static const io::ScratchFolder scratch;
    return scratch.path();
}

fs::path file_of(const std::string& bytes, const std::string& name) {
    const fs::path path = folder() / name;
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    return path;
}

template <const char* name>
void mesh(const std::string& bytes) {
    const io::WithoutWall here;
    const geometry::TriangleMesh mesh = anatomy::load_mesh(file_of(bytes, name));
    const int corners = static_cast<int>(mesh.vertices.size());
    for (const auto& triangle : mesh.triangles)
        for (const int corner : triangle)
            if (corner < 0 || corner >= corners)
                throw std::logic_error("a triangle names a corner that is not there");
    for (const geometry::Vec3& corner : mesh.vertices)
        if (!corner.allFinite()) throw std::logic_error("a corner is not finite");
}
constexpr char stl[] = "mesh.stl", obj[] = "mesh.obj", ply[] = "mesh.ply", off[] = "mesh.off",
               vtp[] = "mesh.vtp", vtk[] = "mesh.vtk", glb[] = "mesh.glb", gltf[] = "mesh.gltf";

template <const char* name>
void centrelines(const std::string& bytes) {
    const io::WithoutWall here;
    anatomy::load_centrelines(file_of(bytes, name), 1.0);
}
constexpr char lines_json[] = "lines.json", lines_csv[] = "lines.csv", lines_pth[] = "lines.pth",
               lines_vtp[] = "lines.vtp";

template <const char* name>
void ct(const std::string& bytes) {
    const io::WithoutWall here;
    patient::read_ct(file_of(bytes, name));
}
constexpr char nifti[] = "ct.nii", nifti_gz[] = "ct.nii.gz", nrrd[] = "ct.nrrd";

/// One slice, and another like it 2 mm higher.
void dicom(const std::string& bytes) {
    const io::WithoutWall here;
    fs::create_directories(folder() / "series");
    file_of(bytes, "series/slice.dcm");
    std::string higher = bytes;
    if (const std::size_t place = higher.find("0\\0\\0"); place != std::string::npos) higher[place + 4] = '2';
    file_of(higher, "series/higher.dcm");
    patient::read_ct(folder() / "series");
}

void seg(const std::string& bytes) {
    const io::WithoutWall here;
    patient::read_labels(file_of(bytes, "mask.dcm"));
}

/// The description of an anatomy, whose lumen is a tetrahedron open at one side.
void anatomy_json(const std::string& bytes) {
    file_of(
        "solid t\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 4 0 0\nvertex 2 2 "
        "9\nendloop\nendfacet\n"
        "facet normal 0 0 0\nouter loop\nvertex 4 0 0\nvertex 2 4 0\nvertex 2 2 9\nendloop\nendfacet\n"
        "facet normal 0 0 0\nouter loop\nvertex 2 4 0\nvertex 0 0 0\nvertex 2 2 "
        "9\nendloop\nendfacet\nendsolid t\n",
        "lumen.stl");
    anatomy::load_anatomy(file_of(bytes, "vessel.anatomy.json"));
}

void script(const std::string& bytes) {
    script::parse_commands(bytes, "my.gw");
}
void scenario(const std::string& bytes) {
    scenario::problems(
        scenario::parse_scenario(bytes, folder() / "my.toml", fs::path(SELDINGER_SOURCE) / "assets/devices"));
}
void device(const std::string& bytes) {
    const scenario::Device device = scenario::parse_device(bytes, folder() / "wire.toml");
    for (const geometry::Vec3& point : scenario::free_shape(device))
        if (!point.allFinite()) throw std::logic_error("a point of the shape is not finite");
}
void vessels(const std::string& bytes) {
    anatomy::parse_vessel_file(bytes, folder() / "tree.toml");
}
void keys(const std::string& bytes) {
    room::KeyMap map;
    try {
        map = room::parse_keys(bytes, "keys.toml");
    } catch (const io::InputError& error) {
        if (!std::string(error.what()).starts_with("keys.toml"))
            throw std::logic_error(std::string("a refusal that does not name the file: ") + error.what());
        throw;
    }
    std::set<room::Key> seen;
    const auto take = [&](room::Key key) {
        if (!seen.insert(key).second) throw std::logic_error("a key is given twice");
    };
    for (const auto& keys : map.keys)
        for (const room::Key key : keys) take(key);
    for (const room::InjectionPreset& preset : map.injections) take(preset.key);
    for (const double speed : map.speeds.advance)
        if (!std::isfinite(speed) || speed <= 0) throw std::logic_error("a speed is not a positive number");
}
void batch(const std::string& bytes) {
    run::BatchOptions options;
    options.exercise = [](const std::string& name, const fs::path& beside) {
        return scenario::ExerciseFiles{name, beside / (name + ".toml"), beside / (name + ".gw"), {}};
    };
    run::load_batch(file_of(bytes, "list.toml"), options);
}
void points(const std::string& bytes) {
    io::parse_csv(bytes, "points.csv", io::points_header);
}
void png(const std::string& bytes) {
    const io::WithoutWall here;
    run::read_picture(file_of(bytes, "frame.png"));
}

constexpr std::array all_readers = {Reader{"script", script},
                                    Reader{"scenario", scenario},
                                    Reader{"device", device},
                                    Reader{"vessels", vessels},
                                    Reader{"keys", keys},
                                    Reader{"batch", batch},
                                    Reader{"anatomy", anatomy_json},
                                    Reader{"points", points},
                                    Reader{"png", png},
                                    Reader{"stl", mesh<stl>},
                                    Reader{"obj", mesh<obj>},
                                    Reader{"ply", mesh<ply>},
                                    Reader{"off", mesh<off>},
                                    Reader{"vtp", mesh<vtp>},
                                    Reader{"vtk", mesh<vtk>},
                                    Reader{"glb", mesh<glb>},
                                    Reader{"gltf", mesh<gltf>},
                                    Reader{"lines_json", centrelines<lines_json>},
                                    Reader{"lines_csv", centrelines<lines_csv>},
                                    Reader{"lines_pth", centrelines<lines_pth>},
                                    Reader{"lines_vtp", centrelines<lines_vtp>},
                                    Reader{"nifti", ct<nifti>},
                                    Reader{"nifti_gz", ct<nifti_gz>},
                                    Reader{"nrrd", ct<nrrd>},
                                    Reader{"dicom", dicom},
                                    Reader{"seg", seg}};

}  // namespace

std::span<const Reader> readers() {
    return all_readers;
}

const Reader* find_reader(const std::string& name) {
    for (const Reader& reader : all_readers)
        if (name == reader.name) return &reader;
    return nullptr;
}

bool accepts(const Reader& reader, const std::string& bytes) {
    try {
        reader.read(bytes);
        return true;
    } catch (const io::InputError& error) {
        const std::string said = error.what();
        if (said.empty() || said.size() > 100'000)
            throw std::logic_error("a refusal of " + std::to_string(said.size()) + " bytes");
        if (std::any_of(said.begin(), said.end(), [](char c) {
                return (static_cast<unsigned char>(c) < 0x20 && c != '\n') || c == 0x7f;
            }))
            throw std::logic_error("a refusal with control characters");
        for (const char* word : {"json.exception", "[json", "std::", "toml::", "basic_string",
                                 "vector::", "stod", "bad_alloc", "filesystem error", "Assimp", "libpng"})
            if (said.find(word) != std::string::npos &&
                bytes.find(word) == std::string::npos)  // not a quotation
                throw std::logic_error("a refusal in the words of a library: " + said);
        return false;
    }
}

}  // namespace fuzz
