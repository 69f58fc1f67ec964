// The parts of three.js that the pages use; build.py bundles them.

export {
  AmbientLight, Bone, Box3, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide,
  FrontSide, Group, HemisphereLight, Matrix4, Mesh, MeshBasicMaterial, MeshStandardMaterial, NeutralToneMapping,
  PerspectiveCamera, Points, Raycaster, Scene, ShaderMaterial, Skeleton, SkinnedMesh, Vector2,
  Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
