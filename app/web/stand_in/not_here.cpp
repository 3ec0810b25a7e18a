/// What the page leaves to the program: reading meshes and scans of other programs, which become exercises of
/// a page by `seldinger anatomy import` and app/web.sh. Each says so when it is asked for.

#include "engine/anatomy/mesh_file.h"
#include "engine/io/error.h"
#include "engine/io/wall.h"
#include "engine/patient/ct_samples.h"
#include "engine/patient/patient_files.h"
#include "engine/patient/voxelise.h"

namespace {

[[noreturn]] void refuse(const std::filesystem::path& file) {
    throw io::InputError(
        "{}: a page does not read meshes and scans; expected an exercise that app/web.sh made",
        file.string());
}

}  // namespace

namespace io {

bool has_wall() {
    return false;
}
std::shared_ptr<const geometry::MappedFile> behind_wall(
    const std::filesystem::path& file, const Progress&,
    const std::function<void(geometry::StateStream&, const Progress&)>&, const WallLimits&) {
    refuse(file);
}

}  // namespace io

namespace anatomy {

geometry::TriangleMesh load_mesh(const std::filesystem::path& file) {
    refuse(file);
}
StatedMesh load_stated_mesh(const std::filesystem::path& file) {
    refuse(file);
}
geometry::TriangleMesh parse_stl(const std::string&, const std::string& name) {
    refuse(name);
}

}  // namespace anatomy

namespace patient {

CtImage read_nifti(const std::filesystem::path& file, const io::Progress&) {
    refuse(file);
}
CtImage read_nrrd(const std::filesystem::path& file, const io::Progress&) {
    refuse(file);
}
CtImage read_metaimage(const std::filesystem::path& file, const io::Progress&) {
    refuse(file);
}
CtImage read_dicom(const std::filesystem::path& file, const std::string&, const io::Progress&) {
    refuse(file);
}
std::vector<std::filesystem::path> nifti_data_files(const std::filesystem::path& file) {
    refuse(file);
}
std::vector<std::filesystem::path> nrrd_data_files(const std::filesystem::path& file) {
    refuse(file);
}
std::vector<std::filesystem::path> metaimage_data_files(const std::filesystem::path& file) {
    refuse(file);
}
void refuse_ct(const std::filesystem::path& file, const std::string&, const std::string&) {
    refuse(file);
}
void require_hounsfield(const std::filesystem::path& file, const std::vector<std::int16_t>&) {
    refuse(file);
}
void interpolate_means(CtImage&) {
    refuse("a scan");
}
MeshCoverage::MeshCoverage(const geometry::TriangleMesh&, const render::VolumeGrid&, int) {
    refuse("a patient's mesh");
}
void MeshCoverage::layer(int, std::vector<float>&) const {}

}  // namespace patient
