"""The multipart forms: a mesh, or the id of one that is kept, and the options beside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import nullcontext
from io import BytesIO
from typing import Annotated, Any, ClassVar, Literal

from fastapi import File, Request, UploadFile
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import InitErrorDetails, PydanticCustomError, ValidationError
from starlette.formparsers import MultiPartParser

from service.api.keeping import owner_of
from service.api.names import parse_names
from service.augment.options import MOST, AugmentOptions
from service.errors import InvalidRequest, UnsupportedFormat
from service.finding import blaming
from service.requests import EditOptions, InferOptions, SliderOptions, TransferOptions, Upload
from service.store.meshstore import MeshStore

# Uploads are bounded and are read into memory anyway: keep them off the disk, so that a container
# with a read-only root needs no temporary folder.
MultiPartParser.spool_max_size = 1 << 62

LARGEST_SEED = 2**53 - 1
"""What every program reads from JSON as it is."""

FORM_TYPES = ("multipart/form-data", "application/x-www-form-urlencoded")

Direction = Literal["auto", "+x", "-x", "+y", "-y", "+z", "-z"]
Text = str | SkipJsonSchema[None]


MeshId = Annotated[
    Text, Field(description="The id of a mesh that an earlier answer named, in its stead.")
]
Category = Annotated[
    str,
    Field(
        description="A name that `GET /categories` lists, such as `chair`, or `chair@1.0.0` "
        "for one version of its model; or `auto`."
    ),
]
Up = Annotated[Direction, Field(description="The upload's axis that points up.")]
Front = Annotated[Direction, Field(description="The upload's axis that points to the front.")]
Units = Literal["m", "cm", "mm", "in", "ft"]
FileUnits = Annotated[
    Units,
    Field(description="The file's unit of length, and the answer's; glTF is always metres."),
]
Refine = Annotated[
    bool, Field(description="Whether to improve the inferred values by a fit to the mesh.")
]
Mode = Annotated[
    Literal["blend", "paper"],
    Field(
        description="How the mesh follows its template: blended transforms of the parts "
        "or bones, or the paper's weighted displacements."
    ),
]
Keep = Annotated[
    Text,
    Field(description="The point that stays in place; `GET /categories/{name}` lists them."),
]
Format = Annotated[
    Literal["glb", "gltf", "obj", "ply", "stl", "off"] | SkipJsonSchema[None],
    Field(
        description="The answer's format; by default the upload's own, a zip for a zip. "
        "Another holds the bare geometry."
    ),
]
Strict = Annotated[
    bool,
    Field(
        description="Refuse an edit that would make a size negative or break a relation of "
        "the category, with 422, instead of making the nearest one that does not."
    ),
]


class MeshForm(BaseModel):
    """Base of the forms about meshes.

    Attributes:
        uploads: the parts that are files, each with the field of an id that stands in for it.
    """

    model_config = ConfigDict(extra="forbid")
    uploads: ClassVar[Mapping[str, str]] = {"mesh": "mesh_id"}

    @model_validator(mode="before")
    @classmethod
    def _known_fields(cls, fields: Any) -> Any:
        """Unknown fields are told with the known ones, which pydantic's own error leaves out."""
        unknown = [name for name in fields if name not in cls.model_fields]
        if unknown:
            kind = PydanticCustomError(
                "extra_forbidden", "there is no such field", {"known": list(cls.model_fields)}
            )
            lines = [InitErrorDetails(type=kind, loc=(name,), input=None) for name in unknown]
            raise ValidationError.from_exception_data(cls.__name__, lines)
        return fields


class InferForm(MeshForm):
    """A mesh and how to read it."""

    mesh: Annotated[
        UploadFile | SkipJsonSchema[None],
        File(
            description="The mesh file, or a zip with one mesh and what belongs to it; its format "
            "comes from the name's suffix, else from the part's content type, else from its first "
            "bytes. Either this or `mesh_id`."
        ),
    ] = None
    mesh_id: MeshId = None
    category: Category = "auto"
    up: Up = "auto"
    front: Front = "auto"
    units: FileUnits = "m"
    refine: Refine = True

    def infer_options(self) -> InferOptions:
        """The options as the pipeline takes them."""
        return InferOptions(
            category=self.category,
            up=self.up,
            front=self.front,
            units=self.units,
            refine=self.refine,
        )


class EditForm(InferForm):
    """A mesh, how to read it, and what to change."""

    edits: Annotated[
        Text,
        Field(
            description='A JSON object: a parameter or derived dimension to `{"set": value}`, '
            '`{"add": value}`, `{"scale": factor}` or a bare number, which sets it. May be left '
            "out beside `constraints`.",
            examples=['{"seat_width": {"scale": 1.2}, "seat_top_height": 0.45}'],
            json_schema_extra={"contentMediaType": "application/json"},
        ),
    ] = None
    constraints: Annotated[
        Text,
        Field(
            description='A JSON object: a parameter or derived dimension to `{"min": value}`, '
            '`{"max": value}`, both, or `{"set": value}` or a bare number. The parameters that '
            "`edits` does not name change by as little as it takes, in proportion to their sizes.",
            examples=['{"seat_top_height": 0.45, "total_width": {"max": 0.6}}'],
            json_schema_extra={"contentMediaType": "application/json"},
        ),
    ] = None
    variants: Annotated[
        Text,
        Field(
            description="In place of `edits` and `constraints`: a JSON array of up to 1000 objects "
            "like `edits`. The answer is a zip with a file for each.",
            examples=['[{"seat_width": {"scale": 1.1}}, {"seat_width": {"scale": 1.2}}]'],
            json_schema_extra={"contentMediaType": "application/json"},
        ),
    ] = None
    mode: Mode = "blend"
    keep: Keep = None
    format: Format = None
    strict: Strict = False

    @model_validator(mode="before")
    @classmethod
    def _something_to_do(cls, fields: Any) -> Any:
        """Without constraints a form lacks its edits; an unknown field may be a slip of either."""
        if set(fields) <= set(cls.model_fields) - {"edits", "constraints", "variants"}:
            missing = InitErrorDetails(type="missing", loc=("edits",), input=fields)
            raise ValidationError.from_exception_data(cls.__name__, [missing])
        return fields

    def edit_options(self) -> EditOptions:
        """The options as the pipeline takes them."""
        return EditOptions(self.mode, self.keep, self.format, self.strict)


class AugmentForm(InferForm):
    """A mesh, how to read it, and how many variants of it to draw."""

    count: Annotated[int, Field(ge=1, le=MOST, description="How many variants.")] = 10
    seed: Annotated[
        int, Field(ge=0, le=LARGEST_SEED, description="Another seed gives other variants.")
    ] = 0
    strength: Annotated[
        float,
        Field(ge=0, le=1, description="How far from the upload towards a draw from real shapes."),
    ] = 1.0
    mode: Mode = "blend"
    keep: Keep = None
    format: Format = None

    def edit_options(self) -> EditOptions:
        """The options as the pipeline takes them."""
        return EditOptions(self.mode, self.keep, self.format)

    def augment_options(self) -> AugmentOptions:
        """How the variants are drawn."""
        return AugmentOptions(self.count, self.seed, self.strength)


class SlidersForm(InferForm):
    """A mesh, how to read it, and which sliders to put into it."""

    parameters: Annotated[
        Text,
        Field(
            description="The parameters to offer: names with commas between, or a JSON array; "
            "by default all. `GET /categories/{name}` lists them.",
            examples=["seat_width,leg_height"],
        ),
    ] = None
    keep: Keep = None
    paired: Annotated[
        bool,
        Field(description="Two morph targets a parameter, `<name>+` and `<name>-`, for viewers "
            "that clamp weights to 0..1; by default one, whose weight may be negative."),
    ] = False  # fmt: skip
    quantize: Annotated[
        bool,
        Field(description="Store displacements as 16-bit fractions (KHR_mesh_quantization) where "
            "they are within 1 unit and the error within 0.002 % of the size."),
    ] = False  # fmt: skip
    joint_names: Annotated[
        Literal["smpl", "mixamo", "vrm"],
        Field(description="How the joints of a body are named and turned: SMPL's, Mixamo's, or "
            "those of a VRM humanoid."),
    ] = "smpl"  # fmt: skip
    rest: Annotated[
        Literal["upload", "t_pose"],
        Field(description="The pose that a body's mesh is bound in: its own, or a T-pose."),
    ] = "upload"

    def slider_options(self) -> SliderOptions:
        """The options as the pipeline takes them.

        Raises:
            InvalidRequest: when the names can't be read.
        """
        names = None if self.parameters is None else parse_names(self.parameters)
        return SliderOptions(
            names, self.keep, self.paired, self.quantize, self.joint_names, self.rest
        )


class TransferForm(MeshForm):
    """Two meshes, how to read them, and what of the one the other is to get."""

    uploads: ClassVar[Mapping[str, str]] = {
        "source": "source_mesh_id",
        "target": "target_mesh_id",
    }

    source: Annotated[
        UploadFile | SkipJsonSchema[None],
        File(description="The mesh to edit, as `mesh` of `/edit`. Either this or "
            "`source_mesh_id`."),
    ] = None  # fmt: skip
    source_mesh_id: MeshId = None
    target: Annotated[
        UploadFile | SkipJsonSchema[None],
        File(description="The mesh to take the parameters from. Either this or "
            "`target_mesh_id`."),
    ] = None  # fmt: skip
    target_mesh_id: MeshId = None
    category: Category = "auto"
    up: Annotated[Direction, Field(description="The source's axis that points up.")] = "auto"
    front: Annotated[
        Direction, Field(description="The source's axis that points to the front.")
    ] = "auto"
    units: Annotated[
        Units,
        Field(description="The source's unit of length, and the answer's; glTF is always metres."),
    ] = "m"
    target_up: Annotated[Direction, Field(description="The target's axis that points up.")] = "auto"
    target_front: Annotated[
        Direction, Field(description="The target's axis that points to the front.")
    ] = "auto"
    target_units: Annotated[
        Units | SkipJsonSchema[None],
        Field(description="The target's unit of length; by default as `units` says."),
    ] = None
    refine: Refine = True
    parameters: Annotated[
        Text,
        Field(
            description="What to take from the target: names with commas between, or a JSON array; "
            "by default all parameters. Derived dimensions may be named too.",
            examples=["seat_width,seat_depth"],
        ),
    ] = None
    size: Annotated[
        Literal["target", "source"],
        Field(description="Whose size it comes to: the target's values in real units, or the "
            "target's proportions at the source's own size."),
    ] = "target"  # fmt: skip
    position: Annotated[
        Literal["source", "target"],
        Field(description="Where it stands: where the source does, or where the target does."),
    ] = "source"
    keep: Keep = None
    mode: Mode = "blend"
    format: Format = None
    strict: Strict = False

    def infer_options(self) -> InferOptions:
        """What is said of the source, as the pipeline takes it."""
        return InferOptions(self.category, self.up, self.front, self.units, self.refine)

    def target_options(self) -> InferOptions:
        """What is said of the target, likewise."""
        units = self.target_units or self.units
        return InferOptions(self.category, self.target_up, self.target_front, units, self.refine)

    def transfer_options(self) -> TransferOptions:
        """The options as the pipeline takes them.

        Raises:
            InvalidRequest: when the names can't be read.
        """
        names = None if self.parameters is None else parse_names(self.parameters)
        way = self.mode, self.keep, self.format, self.strict
        return TransferOptions(*way, names, self.size, self.position)


def form_content_type(request: Request) -> None:
    """Refuse a body that is no form; the framework would read it as an empty one."""
    content_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if content_type and content_type not in FORM_TYPES:
        raise UnsupportedFormat(
            "body_not_a_form",
            f"The body is {content_type[:80]!r}.",
            "Send multipart/form-data with the file as the part `mesh`: curl -F mesh=@chair.glb.",
        )


async def uploads_of(request: Request, form: MeshForm, store: MeshStore) -> tuple[Upload, ...]:
    """The meshes that a form sends or names, in the order of its `uploads`.

    Raises:
        ShapeError: as `_upload_of`.
    """
    return tuple([await _upload_of(request, form, store, part) for part in form.uploads])


async def _upload_of(request: Request, form: MeshForm, store: MeshStore, part: str) -> Upload:
    """One of the meshes.

    Raises:
        InvalidRequest: when it is missing, twofold, or any field is repeated.
        NotFound: when no mesh of the client's is kept under the id.
    """
    by_id = form.uploads[part]
    file, mesh_id = getattr(form, part), getattr(form, by_id)
    names = Counter(name for name, _ in (await request.form()).multi_items())
    repeated = [name for name, count in names.items() if count > 1]
    if file is not None and (mesh_id is not None or part in repeated):
        raise InvalidRequest(
            f"{part}_ambiguous",
            f"The form holds more than one {part}.",
            f"Send one: either one part `{part}` or one field `{by_id}`.",
        )
    # Another file's turn to be told of comes with that file.
    if twice := [name for name in repeated if name == part or name not in form.uploads]:
        raise InvalidRequest(
            "field_repeated",
            f"The form field {twice[0]!r} comes {names[twice[0]]} times.",
            "Send each field once.",
        )
    if file is not None:
        return Upload(await _contents(file), file.filename, file.content_type)
    if mesh_id is not None:
        with blaming(part) if len(form.uploads) > 1 else nullcontext():
            return await store.fetch(mesh_id, owner_of(request))
    raise InvalidRequest(
        f"{part}_missing",
        f"The form holds no {part}.",
        f"Send the file as the part `{part}` (curl -F {part}=@chair.glb), or a `{by_id}`.",
    )


async def _contents(file: UploadFile) -> bytes:
    """Its bytes; a copy of them would hold up the event loop by 50 ms for 100 MB."""
    buffer = getattr(file.file, "_file", None)
    return buffer.getvalue() if isinstance(buffer, BytesIO) else await file.read()
