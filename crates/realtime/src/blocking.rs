//! Blocking forms of the asynchronous calls, named without `_async`. lib.rs compiles this file for native platforms
//! only: the event loop of a browser must not block.

use super::{AdapterChoice, Answers, FrameReport, Gpu, GpuError, Optics, Query, Renderer, Scene, Shader, Target, View};
use pollster::block_on;
use sunbeam::methods::{AnswerKind, Method, MethodShader};

impl Gpu {
    /// Blocking [`Gpu::open_async`].
    ///
    /// # Errors
    /// The errors of [`Gpu::open_async`].
    pub fn open(choice: AdapterChoice) -> Result<Self, GpuError> {
        block_on(Self::open_async(choice))
    }

    /// Blocking [`Gpu::open_on_async`].
    ///
    /// # Errors
    /// The errors of [`Gpu::open_on_async`].
    pub fn open_on(choice: AdapterChoice, backends: wgpu::Backends) -> Result<Self, GpuError> {
        block_on(Self::open_on_async(choice, backends))
    }
}

impl Shader {
    /// Blocking [`Shader::new_async`].
    ///
    /// # Errors
    /// The errors of [`Shader::new_async`].
    pub fn new(gpu: &Gpu, method: &dyn Method, optics: &Optics) -> Result<Self, GpuError> {
        block_on(Self::new_async(gpu, method, optics))
    }

    /// Blocking [`Shader::of_async`].
    ///
    /// # Errors
    /// The errors of [`Shader::of_async`].
    pub fn of(
        gpu: &Gpu,
        method: &MethodShader<'_>,
        answer_kind: AnswerKind,
        optics: &Optics,
    ) -> Result<Self, GpuError> {
        block_on(Self::of_async(gpu, method, answer_kind, optics))
    }

    /// Blocking [`Shader::evaluate_async`].
    ///
    /// # Errors
    /// The errors of [`Shader::evaluate_async`].
    pub fn evaluate(&self, gpu: &Gpu, queries: &[Query]) -> Result<Answers, GpuError> {
        block_on(self.evaluate_async(gpu, queries))
    }

    /// Blocking [`Shader::brdf_map_async`].
    ///
    /// # Errors
    /// The errors of [`Shader::brdf_map_async`].
    pub fn brdf_map(&self, gpu: &Gpu, wi: [f32; 3], side: usize) -> Result<Vec<Option<[f32; 3]>>, GpuError> {
        block_on(self.brdf_map_async(gpu, wi, side))
    }
}

impl Renderer {
    /// Blocking [`Renderer::draw_async`].
    ///
    /// # Errors
    /// The errors of [`Renderer::draw_async`].
    pub fn draw(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        shader: &Shader,
        target: &Target,
        view: &View,
    ) -> Result<FrameReport, GpuError> {
        block_on(self.draw_async(gpu, scene, shader, target, view))
    }
}

impl Target {
    /// Blocking [`Target::read_picture_async`].
    ///
    /// # Errors
    /// The errors of [`Target::read_picture_async`].
    pub fn read_picture(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>, GpuError> {
        block_on(self.read_picture_async(gpu))
    }

    /// Blocking [`Target::read_queries_async`].
    ///
    /// # Errors
    /// The errors of [`Target::read_queries_async`].
    pub fn read_queries(&self, gpu: &Gpu) -> Result<Vec<Query>, GpuError> {
        block_on(self.read_queries_async(gpu))
    }

    /// Blocking [`Target::read_query_async`].
    ///
    /// # Errors
    /// The errors of [`Target::read_query_async`].
    pub fn read_query(&self, gpu: &Gpu, column: u32, row: u32) -> Result<Query, GpuError> {
        block_on(self.read_query_async(gpu, column, row))
    }
}
