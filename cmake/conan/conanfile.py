"""Conan 2: `conan create cmake/conan`, from the top of the project, builds its sources as a package.

A profile with [platform_requires] takes dependencies from the system instead of ConanCenter;
cmake/conan/system.profile has Debian 12's.
"""

import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir


class AdaptiveBvhConan(ConanFile):
    name = "adaptive_bvh"
    license = "BSD-3-Clause"
    description = "Bounding volume hierarchies for FCL that follow deforming meshes"
    topics = ("collision-detection", "distance", "bvh", "deformable", "fcl")
    package_type = "library"
    settings = "os", "compiler", "build_type", "arch"
    options = {"shared": [True, False], "fPIC": [True, False], "mesh_io": [True, False],
               "policy_json": [True, False]}
    default_options = {"shared": False, "fPIC": True, "mesh_io": True, "policy_json": True}

    @property
    def _top(self):
        return os.path.join(self.recipe_folder, "..", "..")

    def set_version(self):
        text = load(self, os.path.join(self._top, "CMakeLists.txt"))
        self.version = re.search(r"project\(adaptive_bvh VERSION ([0-9.]+)", text).group(1)

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "package.xml", "cmake/*", "include/*", "src/*"):
            copy(self, pattern, self._top, self.export_sources_folder)

    def configure(self):
        if self.options.shared:
            self.options.rm_safe("fPIC")

    def requirements(self):
        self.requires("fcl/0.7.0", transitive_headers=True, transitive_libs=True)
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("onetbb/2021.12.0")
        if self.options.mesh_io:
            self.requires("assimp/5.4.3")
            self.requires("zlib/1.3.1")
        if self.options.mesh_io or self.options.policy_json:
            self.requires("nlohmann_json/3.11.3")

    def validate(self):
        check_min_cppstd(self, 17)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        for part in ("RECORDING", "TUNING", "PYTHON", "TESTS", "EXAMPLES", "BENCHMARKS"):
            toolchain.cache_variables[f"ADAPTIVE_BVH_{part}"] = False
        toolchain.cache_variables["ADAPTIVE_BVH_MESH_IO"] = bool(self.options.mesh_io)
        toolchain.cache_variables["ADAPTIVE_BVH_POLICY_JSON"] = bool(self.options.policy_json)
        toolchain.cache_variables["CMAKE_UNITY_BUILD"] = True  # takes half of the time
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        CMake(self).install()
        for folder in ("lib/cmake", "lib/pkgconfig", "share"):
            rmdir(self, os.path.join(self.package_folder, folder))

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "adaptive_bvh")
        core = self.cpp_info.components["core"]
        core.set_property("cmake_target_name", "adaptive_bvh::adaptive_bvh")
        core.set_property("pkg_config_name", "adaptive_bvh")
        core.libs = ["adaptive_bvh"]
        core.defines = ["EIGEN_MAX_ALIGN_BYTES=16"]
        core.requires = self._needs("fcl::fcl", "eigen::eigen", "onetbb::onetbb")
        core.system_libs = ["pthread", "m"]
        for name, needed in (("mesh_io", ("assimp::assimp", "zlib::zlib")),
                             ("policy_json", ("nlohmann_json::nlohmann_json",))):
            if self.options.get_safe(name):
                component = self.cpp_info.components[name]
                component.set_property("cmake_target_name", f"adaptive_bvh::{name}")
                component.libs = [f"adaptive_bvh_{name}"]
                component.requires = ["core", *self._needs(*needed)]
        if self.options.mesh_io and self._needs("nlohmann_json::nlohmann_json"):
            self.cpp_info.components["mesh_io"].requires.append("nlohmann_json::nlohmann_json")

    def _needs(self, *targets):
        """Those that Conan has; the system has the others."""
        known = {require.ref.name for require, _ in self.dependencies.direct_host.items()}
        return [target for target in targets if target.split("::")[0] in known]
