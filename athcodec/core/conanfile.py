"""Conan's recipe for the decoder in C: `conan create athcodec/core`. Consumers get the CMake package that is installed,
with the targets athcodec::ath and athcodec::ath_static."""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class Athcodec(ConanFile):
    name = "athcodec"
    description = "Decoder of .ath files, which hold the motion of plants"
    license = "MIT"
    settings = "os", "arch", "compiler", "build_type"
    exports_sources = "*.c", "*.h", "*.inl", "CMakeLists.txt", "cmake/*", "examples/*"

    def set_version(self):
        package = Path(self.recipe_folder).parent / "__init__.py"  # the one place that names it
        self.version = self.version or re.search(r'^__version__ = "([\d.]+)', package.read_text(), re.M).group(1)

    def export(self):
        copy(self, "LICENSE", Path(self.recipe_folder).parents[1], self.export_folder)

    def configure(self):
        self.settings.rm_safe("compiler.libcxx")
        self.settings.rm_safe("compiler.cppstd")

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables |= {"ATH_VERSION": str(self.version), "ATH_BUILD_EXAMPLES": False}
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.recipe_folder, Path(self.package_folder) / "licenses")

    def package_info(self):
        self.cpp_info.libs = ["ath"]
        self.cpp_info.system_libs = [] if self.settings.os == "Windows" else ["m"]  # ath_player.h calls libm.
        self.cpp_info.builddirs = ["lib/cmake/athcodec"]
        self.cpp_info.set_property("cmake_find_mode", "none")  # the package has its own
