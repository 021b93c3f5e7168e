# Dependencies of the system: conan create cmake/conan -pr:a cmake/conan/system.profile --no-remote
include(default)

[settings]
compiler.cppstd=17

[platform_requires]
fcl/0.7.0
eigen/3.4.0
onetbb/2021.12.0
assimp/5.4.3
zlib/1.3.1
nlohmann_json/3.11.3
